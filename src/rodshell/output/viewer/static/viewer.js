// The 3D viewer: createViewer(element) makes one in a page; show(bytes) gives it a scene, see scene.py.
// Every stage is a shape that was computed; nothing is drawn between them.
const LAYERS = [
  ["target", "Target", true], ["sections", "True sections", false], ["joints", "Joints", false],
  ["reactions", "Reactions", false], ["worst", "Worst place", true],
];
const NEAR = 14;        // px: how near to a rod a click must be
const HOLD = 260;       // ms of each stage of the animation
const REACH = 0.16;     // of the size: length of the largest reaction's arrow
const TYPES = { u1: Uint8Array, i1: Int8Array, u2: Uint16Array, u4: Uint32Array, f4: Float32Array };

export { THREE };

export function readScene(bytes) {
  const buffer = bytes instanceof ArrayBuffer ? bytes : bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const length = new DataView(buffer).getUint32(0, true);
  const scene = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  scene.array = ({ at, type, count }) => new TYPES[type](buffer, 4 + length + at, count);
  return scene;
}

export function fromBase64(text) {
  return Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
}

const make = (name, attributes = {}, ...children) => {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) key in element ? (element[key] = value) : element.setAttribute(key, value);
  element.append(...children);
  return element;
};

export function createViewer(root, { controls = true } = {}) {
  root.classList.add("rs-viewer");
  const canvas = make("canvas", { tabIndex: 0, role: "img", ariaLabel: "The grid in space: drag to turn it, wheel to zoom, arrow keys turn it too" });
  const label = make("div", { className: "label", hidden: true });
  const slider = make("input", { type: "range", min: 0, max: 0, value: 0, step: 1, className: "stages" });
  const play = make("button", { type: "button", textContent: "Play", ariaLabel: "Play the deployment" });
  const caption = make("output", { className: "caption", ariaLive: "polite" });
  const choice = make("select", { className: "colours" });
  const bar = make("div", { className: "bar" }, make("span", { className: "what" }), make("div", { className: "map" }), make("div", { className: "ticks" }));
  const families = make("div", { className: "families", ariaLabel: "Families of rods" });
  const boxes = Object.fromEntries(LAYERS.map(([name, , on]) => [name, make("input", { type: "checkbox", checked: on, className: name })]));
  const reset = make("button", { type: "button", textContent: "Reset view" });
  const picked = make("div", { className: "picked", ariaLive: "polite" });
  const panel = make("div", { className: "controls" },
    make("label", {}, "Stage ", slider), play, reset, caption, make("label", {}, "Colour ", choice), bar, families,
    ...LAYERS.map(([name, text]) => make("label", { className: `layer ${name}` }, boxes[name], ` ${text}`)));
  panel.hidden = !controls;
  root.replaceChildren(make("div", { className: "stage" }, canvas, label), panel, picked);

  const listeners = {}, emit = (event, value) => (listeners[event] || []).forEach(heard => heard(value));
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
  } catch {
    root.replaceChildren(make("p", { className: "failed", textContent: "This browser does not draw in 3D (WebGL is off): the pictures below show the shapes." }));
    return { show() {}, on() {}, dispose() {} };
  }
  const world = new THREE.Scene(), camera = new THREE.PerspectiveCamera(28, 1, 0.01, 100);
  camera.up.set(0, 0, 1);
  const orbit = new THREE.OrbitControls(camera, canvas);
  orbit.listenToKeyEvents(canvas);
  orbit.zoomToCursor = true;
  world.add(new THREE.HemisphereLight(0xffffff, 0xb9b4a8, 2.4));
  const sun = new THREE.DirectionalLight(0xffffff, 1.6);
  sun.position.set(1, -2, 3);
  world.add(sun);
  const dark = matchMedia("(prefers-color-scheme: dark)");

  let scene = null, geometry = null, waiting = false, shown = null, playing = 0, chosen = null;
  const touched = { stage: false, colour: false };  // what a person chose is kept when another scene is shown
  const group = new THREE.Group();
  world.add(group);

  const style = name => getComputedStyle(root).getPropertyValue(name).trim();
  const linear = colour => { const c = new THREE.Color(colour); return [c.r, c.g, c.b]; };
  const stage = () => scene.stages[+slider.value];
  const pixels = () => Math.min(2.6, Math.max(1.1, 95 / Math.max(scene.rods.length, 1)));

  function later() { if (!waiting) { waiting = true; requestAnimationFrame(draw); } }

  function show(bytes, { keepView = false } = {}) {
    const before = scene && stage().name, last = scene;
    scene = readScene(bytes);
    if (last && keepView) follow(last);
    scene.points = scene.stages.map(({ points }) => Float32Array.from(scene.array(points), (value, k) => value / 65535 - scene.box[k % 3] / 2));
    scene.normals = scene.stages.map(({ normals }) => normals && scene.array(normals));
    scene.first = [];
    scene.owner = [];
    scene.start = [];
    scene.rods.reduce((start, { count }, rod) => {
      scene.start.push(start);
      for (let k = 0; k < count - 1; k++) { scene.first.push(start + k); scene.owner.push(rod); }
      return start + count;
    }, 0);
    scene.pairs = scene.array(scene.joints.entries);
    slider.max = scene.stages.length - 1;
    const names = scene.stages.map(({ name }) => name), same = keepView && touched.stage ? names.indexOf(before) : -1;
    const final = names.findLastIndex(name => name.startsWith("popped"));
    slider.value = same >= 0 ? same : final >= 0 ? final : Math.max(names.indexOf("draped"), 0);
    const colour = touched.colour ? choice.value : "";
    choice.replaceChildren(...Object.entries(scene.kinds).map(([value, text]) => make("option", { value, textContent: text })), make("option", { value: "none", textContent: "family" }));
    if ([...choice.options].some(({ value }) => value === colour)) choice.value = colour;
    play.hidden = !scene.stages.some(({ name }) => name.startsWith("stage_"));
    panel.querySelector(".layer.target").hidden = !scene.target;
    panel.querySelector(".layer.reactions").hidden = !Object.keys(scene.supports.reactions).length;
    panel.querySelector(".layer.joints").hidden = !scene.joints.ids.length;
    chosen = null;
    picked.replaceChildren();
    build();
    if (!keepView) home();
    later();
  }

  // The same view of the same place where another scene has another frame.
  function follow({ size, low, box }) {
    for (const place of [camera.position, orbit.target]) {
      place.set(...place.toArray().map((value, k) => ((value + box[k] / 2) * size + low[k] - scene.low[k]) / scene.size - scene.box[k] / 2));
    }
    for (const end of ["minDistance", "maxDistance"]) orbit[end] *= size / scene.size;
    orbit.update();
  }

  // The stage and the target fill the picture, seen from the south-east.
  function home() {
    const points = [scene.points[+slider.value], ...(geometry.target ? [geometry.target.geometry.attributes.position.array] : [])];
    const low = [1, 1, 1], high = [-1, -1, -1], place = new THREE.Vector3();
    for (const part of points) part.forEach((value, k) => { low[k % 3] = Math.min(low[k % 3], value); high[k % 3] = Math.max(high[k % 3], value); });
    const radius = 0.5 * Math.hypot(...low.map((value, axis) => high[axis] - value));
    orbit.target.set(...low.map((value, axis) => 0.5 * (value + high[axis])));
    camera.aspect = canvas.clientWidth / Math.max(canvas.clientHeight, 1);
    const right = new THREE.Vector3(), up = new THREE.Vector3();
    let distance = 4 * radius;
    for (let round = 0; round < 5; round++) {
      camera.position.set(0.42, -0.79, 0.45).multiplyScalar(distance).add(orbit.target);
      camera.lookAt(orbit.target);
      camera.updateProjectionMatrix();
      camera.updateMatrixWorld();
      const seen = { low: [1e9, 1e9], high: [-1e9, -1e9] };
      for (const part of points) for (let k = 0; k < part.length; k += 3) {
        place.fromArray(part, k).project(camera);
        [place.x, place.y].forEach((value, axis) => { seen.low[axis] = Math.min(seen.low[axis], value); seen.high[axis] = Math.max(seen.high[axis], value); });
      }
      const [x, y] = seen.low.map((value, axis) => 0.5 * (value + seen.high[axis])), half = distance * Math.tan(0.5 * camera.fov * Math.PI / 180);
      camera.matrixWorld.extractBasis(right, up, place);
      orbit.target.addScaledVector(right, x * half * camera.aspect).addScaledVector(up, y * half);
      distance *= Math.max(...seen.low.map((value, axis) => 0.5 * (seen.high[axis] - value))) / 0.88;
    }
    orbit.minDistance = 0.05 * radius;
    orbit.maxDistance = 20 * radius;
    orbit.update();
    later();
  }

  function clear() {
    group.traverse(part => { part.geometry?.dispose(); part.material?.dispose(); });
    group.clear();
  }

  function build() {
    clear();
    const segments = 6 * scene.first.length;
    geometry = { positions: new Float32Array(segments), colours: new Float32Array(segments) };
    const lines = new THREE.LineSegmentsGeometry();
    lines.setPositions(geometry.positions);
    lines.setColors(geometry.colours);
    geometry.lines = new THREE.LineSegments2(lines, new THREE.LineMaterial({ vertexColors: true, linewidth: pixels(), fog: true }));
    geometry.lines.frustumCulled = false;
    group.add(geometry.lines);
    geometry.tubes = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.75, side: THREE.DoubleSide }));
    geometry.tubes.frustumCulled = false;
    group.add(geometry.tubes);
    if (scene.target) {
      const surface = new THREE.BufferGeometry(), points = scene.array(scene.target.points);
      surface.setAttribute("position", new THREE.Float32BufferAttribute(Float32Array.from(points, (value, k) => value / 65535 - scene.box[k % 3] / 2), 3));
      surface.setIndex(new THREE.BufferAttribute(new Uint32Array(scene.array(scene.target.faces)), 1));
      surface.computeVertexNormals();
      geometry.target = new THREE.Mesh(surface, new THREE.MeshLambertMaterial({ color: 0x9fb4c0, transparent: true, opacity: 0.32, side: THREE.DoubleSide, depthWrite: false }));
      group.add(geometry.target);
    }
    geometry.joints = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ size: 5, sizeAttenuation: false }));
    geometry.joints.frustumCulled = false;
    geometry.arrows = new THREE.LineSegments2(new THREE.LineSegmentsGeometry(), new THREE.LineMaterial({ color: 0x2b7a4b, linewidth: 2 }));
    geometry.arrows.frustumCulled = false;
    geometry.marked = new THREE.LineSegments2(new THREE.LineSegmentsGeometry(), new THREE.LineMaterial({ color: 0xd0342c, linewidth: 4.5 }));
    geometry.marked.frustumCulled = false;
    geometry.worst = new THREE.Mesh(new THREE.SphereGeometry(0.009, 20, 12), new THREE.MeshBasicMaterial({ color: 0xd0342c }));
    group.add(geometry.joints, geometry.arrows, geometry.marked, geometry.worst);
    shown = null;
  }

  // Colours (n, 3) of all entries, linear; by family where the stage has no values of this kind.
  const seen = colour => linear(colour).map(value => value + (dark.matches ? 0.3 : 0) * (1 - value));
  function colours() {
    const scale = stage().colours[choice.value], count = scene.points[0].length / 3, result = new Float32Array(3 * count);
    if (scale) {
      const palette = scene.palettes[choice.value].map(seen), bins = scene.array(scale.bins), unknown = seen("#8a8f94");
      for (let k = 0; k < count; k++) result.set(palette[bins[k]] || unknown, 3 * k);
    } else {
      scene.rods.forEach(({ ink, count: entries }, rod) => {
        const colour = seen(ink);
        for (let k = 0; k < entries; k++) result.set(colour, 3 * (scene.start[rod] + k));
      });
    }
    return result;
  }

  function update() {
    const key = [slider.value, choice.value, boxes.sections.checked, dark.matches].join();
    if (shown === key) return;
    shown = key;
    const points = scene.points[+slider.value], tint = colours(), { positions, colours: colour } = geometry;
    if (boxes.sections.checked) {
      tubes(points, tint, scene.normals[+slider.value]);
    } else {
      scene.first.forEach((a, k) => {
        for (let c = 0; c < 6; c++) { positions[6 * k + c] = points[3 * a + c]; colour[6 * k + c] = tint[3 * a + c]; }
      });
      geometry.lines.geometry.setPositions(positions);
      geometry.lines.geometry.setColors(colour);
    }
    const places = new Float32Array(3 * scene.joints.ids.length);
    for (let k = 0; k < scene.joints.ids.length; k++) for (let c = 0; c < 3; c++) {
      places[3 * k + c] = 0.5 * (points[3 * scene.pairs[2 * k] + c] + points[3 * scene.pairs[2 * k + 1] + c]);
    }
    scene.places = places;
    geometry.joints.geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    arrows(points);
    legend();
    mark();
    const worst = stage().colours[choice.value]?.worst;
    geometry.worst.userData = worst || null;
    if (worst) geometry.worst.position.set(...worst.at.map((value, axis) => value - scene.box[axis] / 2));
  }

  // The section swept along every rod: across = normal x tangent, up = normal; of round sections any normal serves.
  function tubes(points, tint, normals) {
    const outline = scene.outline, s = outline.length, count = points.length / 3;
    const widths = scene.widths ? scene.array(scene.widths) : null;  // of rods whose sections change along them
    const vertices = new Float32Array(3 * s * count), colour = new Float32Array(3 * s * count);
    const faces = new Uint32Array(6 * s * scene.first.length);
    const t = new THREE.Vector3(), n = new THREE.Vector3(), across = new THREE.Vector3();
    scene.rods.forEach(({ count: entries }, rod) => {
      for (let k = 0; k < entries; k++) {
        const entry = scene.start[rod] + k, before = scene.start[rod] + Math.max(k - 1, 0), after = scene.start[rod] + Math.min(k + 1, entries - 1);
        t.set(...[0, 1, 2].map(c => points[3 * after + c] - points[3 * before + c])).normalize();
        if (normals) n.set(normals[3 * entry], normals[3 * entry + 1], normals[3 * entry + 2]);
        else n.set(0, 0, 1);
        n.addScaledVector(t, -n.dot(t));
        if (n.lengthSq() < 1e-6) n.set(1, 0, 0).addScaledVector(t, -t.x);
        n.normalize();
        across.crossVectors(n, t);
        const [wider, higher] = widths ? [widths[2 * entry], widths[2 * entry + 1]] : [1, 1];
        outline.forEach(([wide, high], j) => {
          for (let c = 0; c < 3; c++) {
            vertices[3 * (s * entry + j) + c] = points[3 * entry + c] + wider * wide * across.getComponent(c) + higher * high * n.getComponent(c);
            colour[3 * (s * entry + j) + c] = tint[3 * entry + c];
          }
        });
      }
    });
    scene.first.forEach((a, k) => {
      for (let j = 0; j < s; j++) {
        const i = (j + 1) % s;
        faces.set([s * a + j, s * a + i, s * (a + 1) + i, s * a + j, s * (a + 1) + i, s * (a + 1) + j], 6 * (s * k + j));
      }
    });
    const mesh = geometry.tubes.geometry;
    mesh.setAttribute("position", new THREE.BufferAttribute(vertices, 3));
    mesh.setAttribute("color", new THREE.BufferAttribute(colour, 3));
    mesh.setIndex(new THREE.BufferAttribute(faces, 1));
    mesh.computeVertexNormals();
  }

  function arrows(points) {
    const reactions = scene.supports.reactions[stage().name], ends = scene.array(scene.supports.entries), lines = [];
    if (reactions) {
      const forces = scene.array(reactions.forces);
      ends.forEach((entry, k) => {
        const tip = [0, 1, 2].map(c => points[3 * entry + c]), force = [0, 1, 2].map(c => forces[3 * k + c]);
        lines.push(...tip.map((value, c) => value - REACH * force[c]), ...tip);
      });
    }
    geometry.arrows.geometry.dispose();
    geometry.arrows.geometry = new THREE.LineSegmentsGeometry();
    geometry.arrows.userData.known = lines.length > 0;
    if (lines.length) geometry.arrows.geometry.setPositions(lines);
  }

  // Every stage has a scale of its own.
  function legend() {
    const scale = stage().colours[choice.value], palette = scene.palettes[choice.value];
    bar.style.visibility = scale ? "visible" : "hidden";
    caption.textContent = stage().caption;
    slider.setAttribute("aria-valuetext", stage().caption);
    families.hidden = Boolean(scale) || !(scene.families?.length > 1);
    bar.hidden = !families.hidden;
    families.replaceChildren(...(scene.families || []).map(([name, ink]) => {
      const swatch = make("i", {});
      swatch.style.background = `#${new THREE.Color(...seen(ink)).getHexString()}`;
      return make("span", {}, swatch, ` family ${name.toUpperCase()}`);
    }));
    if (!scale) return;
    const step = 100 / palette.length, stops = palette.map((colour, k) => `${colour} ${k * step}% ${(k + 1) * step}%`);
    bar.querySelector(".map").style.background = `linear-gradient(90deg, ${stops})`;
    bar.querySelector(".what").textContent = scale.caption;
    bar.querySelector(".ticks").replaceChildren(...scale.ticks.map(([share, text]) => {
      const tick = make("span", { textContent: text.replace("-", "\u2212") });
      tick.style.left = `${100 * share}%`;
      return tick;
    }));
  }

  function draw() {
    waiting = false;
    if (!scene) return;
    const width = canvas.clientWidth, height = canvas.clientHeight, ratio = window.devicePixelRatio || 1;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      renderer.setPixelRatio(ratio);
      renderer.setSize(width, height, false);
      camera.aspect = width / Math.max(height, 1);
      camera.updateProjectionMatrix();
    }
    update();
    const paper = style("--rs-paper") || "#fdfdfb", distance = camera.position.distanceTo(orbit.target), deep = 0.5 * Math.hypot(...scene.box);
    renderer.setClearColor(paper);
    world.fog = new THREE.Fog(paper, Math.max(distance - deep, 0.01), distance + 3 * deep);
    geometry.lines.visible = !boxes.sections.checked;
    geometry.tubes.visible = boxes.sections.checked;
    geometry.lines.material.linewidth = pixels() * Math.min(3, Math.max(1, 1.6 / distance));
    if (geometry.target) geometry.target.visible = boxes.target.checked && stage().name !== "flat";
    geometry.joints.visible = boxes.joints.checked;
    geometry.joints.material.color.set(style("--rs-ink") || "#22282f");
    geometry.arrows.visible = boxes.reactions.checked && geometry.arrows.userData.known;
    const worst = boxes.worst.checked && geometry.worst.userData?.at ? geometry.worst.userData : null;
    geometry.worst.visible = Boolean(worst);
    geometry.worst.scale.setScalar(Math.max(0.35, distance / 2.2));
    const place = worst && geometry.worst.position.clone().project(camera);
    label.hidden = !worst || Math.max(Math.abs(place.x), Math.abs(place.y), Math.abs(place.z)) > 1; // outside the view
    if (!label.hidden) {
      label.textContent = worst.text;
      const half = 0.5 * label.offsetWidth, above = label.offsetHeight + 10;
      label.style.left = `${Math.max(half, Math.min(width - half, (0.5 + 0.5 * place.x) * width))}px`;
      label.style.top = `${Math.max(above, (0.5 - 0.5 * place.y) * height)}px`;
    }
    renderer.render(world, camera);
  }

  function mark() {
    const lines = [], points = scene.points[+slider.value];
    if (chosen?.kind === "rod") {
      const start = scene.start[chosen.index];
      for (let k = 0; k < scene.rods[chosen.index].count - 1; k++) lines.push(...points.slice(3 * (start + k), 3 * (start + k) + 6));
    } else if (chosen?.kind === "joint") {
      const place = [...scene.places.slice(3 * chosen.index, 3 * chosen.index + 3)], size = 0.012;
      for (let c = 0; c < 3; c++) for (const [d, e] of [[-size, size]]) lines.push(...place.map((v, i) => v + (i === c ? d : 0)), ...place.map((v, i) => v + (i === c ? e : 0)));
    }
    geometry.marked.geometry.dispose();
    geometry.marked.geometry = new THREE.LineSegmentsGeometry();
    geometry.marked.visible = lines.length > 0;
    if (lines.length) geometry.marked.geometry.setPositions(lines);
  }

  // What lies under the pointer: a joint within NEAR pixels, or else a rod.
  function under(event) {
    const frame = canvas.getBoundingClientRect(), place = new THREE.Vector3();
    const at = (array, k) => {
      place.set(array[3 * k], array[3 * k + 1], array[3 * k + 2]).project(camera);
      return [(0.5 + 0.5 * place.x) * frame.width + frame.left, (0.5 - 0.5 * place.y) * frame.height + frame.top, place.z];
    };
    const best = (count, distance) => {
      let found = -1, least = NEAR, depth = 1;
      for (let k = 0; k < count; k++) {
        const [away, z] = distance(k);
        if (z < 1 && away <= NEAR && (away < least - 3 || (away < least + 3 && z < depth))) { found = k; least = away; depth = z; }
      }
      return found;
    };
    const joint = best(scene.joints.ids.length, k => { const [x, y, z] = at(scene.places, k); return [2 * Math.hypot(x - event.clientX, y - event.clientY), z]; });
    if (joint >= 0) return { kind: "joint", index: joint, id: scene.joints.ids[joint] };
    const points = scene.points[+slider.value];
    const segment = best(scene.first.length, k => {
      const [ax, ay, az] = at(points, scene.first[k]), [bx, by] = at(points, scene.first[k] + 1);
      const length = (bx - ax) ** 2 + (by - ay) ** 2 || 1;
      const share = Math.min(1, Math.max(0, ((event.clientX - ax) * (bx - ax) + (event.clientY - ay) * (by - ay)) / length));
      return [Math.hypot(ax + share * (bx - ax) - event.clientX, ay + share * (by - ay) - event.clientY), az];
    });
    if (segment < 0) return null;
    const rod = scene.owner[segment];
    return { kind: "rod", index: rod, id: scene.rods[rod].id };
  }

  function pick(found, tell = true) {
    chosen = found;
    const table = found && scene.rows[found.kind], row = table?.rows[found.id];
    picked.replaceChildren();
    if (row) picked.append(make("table", {}, make("tbody", {},
      make("tr", {}, ...table.columns.map(text => make("th", { textContent: text, scope: "col" }))),
      make("tr", {}, ...row.map(text => make("td", { textContent: text, title: text }))))));
    mark();
    later();
    if (tell) emit("pick", found);
  }

  function select(kind, id) {
    const index = kind === "rod" ? scene.rods.findIndex(rod => rod.id === id) : scene.joints.ids.indexOf(id);
    pick(index < 0 ? null : { kind, index, id }, false);
  }

  function stop() { clearInterval(playing); playing = 0; play.textContent = "Play"; }

  function animate() {
    if (playing) return stop();
    const names = scene.stages.map(({ name }) => name), order = ["flat", ...names.filter(name => name.startsWith("stage_")), "popped_pinned"];
    const frames = order.map(name => names.indexOf(name)).filter(k => k >= 0);
    let k = 0;
    play.textContent = "Stop";
    playing = setInterval(() => {
      slider.value = frames[k++];
      later();
      if (k >= frames.length) stop();
    }, HOLD);
  }

  let down = null;
  canvas.addEventListener("pointerdown", event => { down = event; });
  canvas.addEventListener("pointerup", event => {
    if (down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < 4) pick(under(event));
    down = null;
  });
  let looking = false;
  canvas.addEventListener("pointermove", event => {  // at most once a frame
    if (!listeners.hover || event.buttons || looking || !scene) return;
    looking = true;
    requestAnimationFrame(() => { looking = false; emit("hover", under(event)); });
  });
  orbit.addEventListener("change", later);
  slider.addEventListener("input", () => { stop(); touched.stage = true; later(); });
  choice.addEventListener("change", () => { touched.colour = true; later(); });
  play.addEventListener("click", animate);
  reset.addEventListener("click", home);
  for (const box of Object.values(boxes)) box.addEventListener("change", later);
  const restyle = () => { shown = null; later(); };
  dark.addEventListener("change", restyle);
  const resized = new ResizeObserver(later);
  resized.observe(canvas);

  return {
    show, select, home, redraw: later, camera, orbit, world, renderer, canvas,
    on(event, heard) { (listeners[event] ||= []).push(heard); },
    get scene() { return scene; },
    target: () => geometry?.target || null,
    dispose() { stop(); resized.disconnect(); dark.removeEventListener("change", restyle); clear(); renderer.dispose(); },
  };
}
