// The 3D view: drag to turn, wheel or pinch to zoom, slider from flat to popped. Draws on a plain canvas.
(() => {
  const source = document.getElementById("view-data");
  if (!source) return;
  const data = JSON.parse(source.textContent), canvas = document.getElementById("view"), LAYERS = 16;
  const slider = document.getElementById("view-stage"), caption = document.getElementById("view-caption");
  const choice = document.getElementById("view-colour"), bar = document.getElementById("view-bar");
  const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  for (const frame of data.frames) {
    frame.places = new Uint16Array(bytes(frame.places).buffer);
    for (const kind of Object.keys(data.palettes)) if (frame[kind]) frame[kind].bins = bytes(frame[kind].bins);
  }
  const count = data.frames[0].places.length / 3, first = [], owner = [];
  data.rods.reduce((start, length, rod) => {
    for (let k = 0; k < length - 1; k++) { first.push(start + k); owner.push(rod); }
    return start + length;
  }, 0);
  const inks = [...new Set(data.inks)], ink = data.inks.map(colour => inks.indexOf(colour));
  const x = new Float32Array(count), y = new Float32Array(count), depth = new Float32Array(count);
  let azimuth = -1.08, elevation = 0.47, zoom = 1, waiting = false, shown = null;

  const mixed = (colour, share) => {
    const channel = k => Math.round(parseInt(colour.slice(k, k + 2), 16) * (1 - share) + [253, 253, 251][(k - 1) / 2] * share);
    return `rgb(${channel(1)},${channel(3)},${channel(5)})`;
  };

  function project(frame) {
    const c = Math.cos(azimuth), s = Math.sin(azimuth), ce = Math.cos(elevation), se = Math.sin(elevation);
    const middle = data.box.map(side => side / 2), reach = Math.hypot(...data.box) || 1;
    const wide = 1.2 * Math.max(data.box[0], data.box[1]), tall = 0.45 * wide + 0.9 * data.box[2];
    const scale = 0.92 * zoom * Math.min(canvas.width / wide, canvas.height / tall);
    for (let k = 0; k < count; k++) {
      const [px, py, pz] = [0, 1, 2].map(axis => frame.places[3 * k + axis] / 65535 - middle[axis]);
      x[k] = canvas.width / 2 + scale * (-s * px + c * py);
      y[k] = canvas.height / 2 - scale * (-se * c * px - se * s * py + ce * pz);
      depth[k] = 0.5 + (ce * c * px + ce * s * py + se * pz) / reach;
    }
  }

  function draw() {
    waiting = false;
    const frame = data.frames[+slider.value], pen = canvas.getContext("2d"), ratio = window.devicePixelRatio || 1;
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = canvas.clientHeight * ratio;
    project(frame);
    const scale = frame[choice.value], bins = scale && scale.bins, palette = bins ? data.palettes[choice.value] : inks;
    const buckets = Array.from({ length: LAYERS * palette.length }, () => []);
    for (let k = 0; k < first.length; k++) {
      const a = first[k], layer = Math.max(0, Math.min(LAYERS - 1, Math.floor(LAYERS * (depth[a] + depth[a + 1]) / 2)));
      buckets[layer * palette.length + (bins ? (bins[a] + bins[a + 1]) >> 1 : ink[owner[k]])].push(a);
    }
    const width = ratio * Math.min(2.2, Math.max(0.6, 70 / data.rods.length)) * Math.sqrt(zoom);
    const stroke = (segments, colour, wide) => {
      pen.beginPath();
      for (const a of segments) { pen.moveTo(x[a], y[a]); pen.lineTo(x[a + 1], y[a + 1]); }
      pen.strokeStyle = colour;
      pen.lineWidth = wide;
      pen.stroke();
    };
    pen.fillStyle = "#fdfdfb";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    for (let layer = 0; layer < LAYERS; layer++) {
      const near = (layer + 0.5) / LAYERS, mine = buckets.slice(layer * palette.length, (layer + 1) * palette.length);
      pen.lineCap = "butt";
      stroke(mine.flat(), "#fdfdfb", 2.6 * width);
      pen.lineCap = "round";
      mine.forEach((segments, k) => segments.length && stroke(segments, mixed(palette[k], 0.5 * (1 - near)), width * (0.7 + 0.5 * near)));
    }
    caption.textContent = frame.caption;
    slider.setAttribute("aria-valuetext", frame.caption);
    showBar(scale, palette);
  }

  function showBar(scale, palette) {  // every frame has a scale of its own
    bar.style.visibility = scale ? "visible" : "hidden";
    if (!scale || scale === shown) return;
    shown = scale;
    const step = 100 / palette.length;
    const stops = palette.map((colour, k) => `${colour} ${k * step}% ${(k + 1) * step}%`);
    bar.querySelector(".map").style.background = `linear-gradient(90deg, ${stops})`;
    bar.querySelector(".what").textContent = scale.caption;
    bar.querySelector(".ticks").replaceChildren(...scale.ticks.map(([share, text]) => {
      const tick = document.createElement("span");
      tick.textContent = text.replace("-", "\u2212");
      tick.style.left = `${100 * share}%`;
      return tick;
    }));
  }

  const later = () => { if (!waiting) { waiting = true; requestAnimationFrame(draw); } };
  const fingers = new Map();
  canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); fingers.set(event.pointerId, event); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, event => fingers.delete(event.pointerId));
  canvas.addEventListener("pointermove", event => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    if (fingers.size === 1) {
      azimuth -= (event.clientX - last.clientX) / 150;
      elevation = Math.max(-1.57, Math.min(1.57, elevation + (event.clientY - last.clientY) / 150));
    } else {
      const other = [...fingers.values()].find(finger => finger.pointerId !== event.pointerId);
      const apart = finger => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY);
      zoom *= apart(event) / Math.max(apart(last), 1);
    }
    fingers.set(event.pointerId, event);
    later();
  });
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    zoom = Math.max(0.3, Math.min(30, zoom * Math.exp(-event.deltaY / 500)));
    later();
  }, { passive: false });
  slider.addEventListener("input", later);
  choice.addEventListener("change", later);
  addEventListener("resize", later);
  draw();
})();
