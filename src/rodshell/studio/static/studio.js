// The studio's page. It holds a case (tables as in a case file), sends each change to the server, and shows what comes
// back. While a slider or a handle is dragged, changes are "live"; when it is let go, the case is found from nothing.
import { createViewer, THREE } from "/static/viewer.js";
import GUI from "/static/lil-gui.js";

const byId = name => document.getElementById(name);
const make = (name, attributes = {}, ...children) => {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) key in element ? (element[key] = value) : element.setAttribute(key, value);
  element.append(...children);
  return element;
};
const clone = value => JSON.parse(JSON.stringify(value));
const get = (tables, path) => path.split(".").reduce((inner, name) => inner?.[name], tables);
const set = (tables, path, value) => {
  const names = path.split("."), last = names.pop();
  const table = names.reduce((inner, name) => (inner[name] = isTable(inner[name]) ? inner[name] : {}), tables);
  value === undefined || value === "" ? delete table[last] : (table[last] = value);
};

const LATTICES = [  // kind, families, name, rods of one family within 24 x 24, the angles of all families, what it is
  ["chebyshev", 2, "Chebyshev", "M1 9Q12 2 23 9M1 15Q12 8 23 15M1 21Q12 14 23 21", [0, 90], "Joints at equal distances: flat, the grid is straight and square"],
  ["geodesic", 2, "Geodesic", "M1 9Q12 2 23 9M1 12H23M1 15Q12 22 23 15", [0, 90], "Laths that lie flat on the surface, straight when they are unrolled"],
  ["geodesic", 3, "Geodesic, three families", "M1 8Q12 3 23 8M1 12H23M1 16Q12 21 23 16", [0, 60, 120], "Laths that lie flat on the surface, with triangles between them"],
  ["asymptotic", 2, "Asymptotic, for saddles", "M1 4Q12 11 23 4M1 12H23M1 20Q12 13 23 20", [45, 135], "Strips upright on a surface that curves both ways, as a saddle does"],
  ["curves", 2, "Given lines", "M1 6Q8 2 13 8T23 6M1 14Q9 18 23 12", [0, 80], "Rods along the lines that the case gives"],
];
const SLIDERS = [  // key, name, and how its range follows from its value
  ["layout.spacing", "Spacing", "length"], ["layout.rotate", "Heading", "angle"],
  ["layout.crossing", "Crossing", "crossing"],
  ["target.radius", "Radius", "length"], ["target.height", "Height", "length"], ["target.a", "Half-axis x", "length"],
  ["target.b", "Half-axis y", "length"], ["target.c", "Half-axis z", "length"], ["target.base", "Base plane", "place"],
  ["target.scale", "Scale", "factor"],
];
const MOST = { snow: 3, wind: 1.5 };  // kN/m2, at the ends of their sliders
const FIRST = [["pop_up.ends", "Ends"], ["joint.kind", "Joints"], ["drape.method", "Drape"]];
const CABLES = { section: "rod 6", material: { preset: "spring-steel", youngs_modulus: "160 GPa" }, prestrain: 0.0005, ends_at: "supports" };  // of design.py
const THIN = 25, THIN_CABLE = "rod 4";  // mm: depth of rods up to which cables are so thin
const GROUPS = {
  target: "Target", layout: "Lattice", rod: "Rods", "rod.section": "Section of the rods", "rod.material": "Material of the rods", joint: "Joints",
  drape: "Draping", pop_up: "Supports", refine: "Refinement", seams: "Seams", checks: "Checks", fabrication: "Fabrication", drawings: "Drawings",
  "drawings.layers": "Layers of DXF files", bracing: "Bracing", "bracing.section": "Section of the bracing", "bracing.material": "Material of the bracing",
  locked_joints: "Locked joints", stability: "Stability", strength: "Strength", design: "Design to loads",
};
const NAMES = {
  a: "half-axis a", b: "half-axis b", c: "half-axis c", EA: "axial stiffness EA", EI1: "bending stiffness EI1", EI2: "bending stiffness EI2", GJ: "twist stiffness GJ",
  C1: "stiffness C1", C2: "stiffness C2", youngs_modulus: "Young's modulus", poisson_ratio: "Poisson's ratio", preset: "named material", section: "in words",
};
const UNITS_SHOWN = { m: ["mm", 1000], rad: ["\u00b0", 180 / Math.PI] };  // of the page, for those of a case
const unitOf = ({ unit }) => UNITS_SHOWN[unit] || [unit, 1];
const tableOf = ({ path }) => (path in GROUPS ? path : path.replace(/\.[^.]*$/, ""));
const groupOf = key => GROUPS[tableOf(key)] || tableOf(key).replaceAll(/[._]/g, " ");
const nameOf = ({ path }) => { const name = path.split(".").at(-1); return NAMES[name] || name.replaceAll("_", " "); };
const TIMEOUT = 1500;  // ms after which a lost connection is tried again
const TABS = 1000;  // serials modulo TABS tell which tab sent a case: the server numbers its pages
const mine = number => number % TABS === tab;
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const isTable = value => typeof value === "object" && value !== null && !Array.isArray(value);
const NO_CASE = "The link in the address holds no case, or is damaged or cut off, or holds more than the studio reads: copy it again. What is shown is another case.";

let start, session, socket, viewer, gui, drawn, ready = false;  // ready: the server has said what it holds
let tab = 0, base = {}, resolved = null, serial = TABS * Date.now(), taken = 0, waiting = null, shown = 0, facts = null, history = { at: -1, cases: [], variants: [] };

// The case, and what is sent

function change(edit, live = false) {
  const next = clone(base);
  edit(next);
  submit(next, live);
}

function submit(next, live) {
  outdate(!same(next, base), live);
  if (["kind", "file"].some(key => next.target?.[key] !== base.target?.[key])) resolved = null;  // values of another surface
  base = next;
  notice("");
  const soon = waiting;
  serial = TABS * (Math.floor(serial / TABS) + 1) + tab;
  waiting = { kind: "case", serial, case: base, live };  // at most one waits: the newest
  if (!live) post();
  else if (!soon) requestAnimationFrame(post);  // at most one a frame
  if (!live) remember();
  showTools();
}

// What is shown is of a case before, at once. While somebody drags, the shapes follow the hand: they are marked only if
// they are behind it when it lets go, as where a text is typed, which is also sent live.
function outdate(changed, live) {
  const box = byId("verdict");
  if (changed && !live && box.classList.contains("failed")) {  // its sentence and buttons are about values that are changed
    box.className = "waiting";
    box.replaceChildren(make("strong", { textContent: "Looking for the form" }));
  }
  box.classList.add("old");
  if (changed) byId("figures").classList.add("old");
  if (!live && (shown !== serial || (changed && !dragging))) document.body.classList.add("old");
  dragging = live;
  offer(false);
}
let dragging = false;  // the last change was live

// What can be done with a form once it has its verdict.
function offer(ready) {
  byId("python").disabled = byId("keep").querySelector("button").disabled = !ready;
  byId("download").setAttribute("aria-disabled", String(!ready));
  if (ready) byId("download").href = `/api/sessions/${session}/files.zip`;
  else byId("download").removeAttribute("href");
}

// Buttons for what takes longer; each is a part of the case

const DEPLOYMENT = 8;  // equilibria from flat
const yIsUp = next => (get(next, "target.up") ?? (/\.(glb|gltf)$/i.test(get(next, "target.file")) ? "y" : "z")) === "y";

function showTools() {
  const press = (name, on) => byId(name).setAttribute("aria-pressed", String(Boolean(on)));
  press("refine", get(base, "refine.vary")?.length);
  press("loads", Array.isArray(base.loads) ? base.loads.length : base.loads);
  press("erection", get(base, "checks.stages") ?? DEPLOYMENT);
  byId("upright").hidden = !takesOutline() || base.target.kind === "heights";
  press("upright", yIsUp(base));
  const drawn = get(base, "target.boundary");
  byId("outline").hidden = !takesOutline();
  byId("no-outline").hidden = !drawn;
  byId("no-outline").textContent = drawn ? `${words(drawn).replace("upload:", "")} \u00d7` : "";
  byId("no-outline").ariaLabel = `Remove the outline ${byId("no-outline").textContent.slice(0, -2)}`;
}

// The dialog edits the case's own weight and snow; its other loads and its combinations stay unless they are removed.
const EDITED = [["self_weight", "cladding"], ["snow", "value"]];  // kind, key
const tablesIn = value => (Array.isArray(value) ? value.filter(isTable) : []);  // a case from a link may hold anything
const words = value => (typeof value === "string" ? value : JSON.stringify(value));

// `wrong`: the load or combination that a message is about, such as { noun: "load", number: 2 }.
function showLoads(wrong = null) {
  const loads = tablesIn(base.loads), { elements } = byId("load-values").querySelector("form");
  const isWrong = (noun, table) => wrong?.noun === noun && base[`${noun}s`]?.[wrong.number - 1] === table;
  let first = null;  // field or row that is wrong
  for (const [kind, key] of EDITED) {
    const found = loads.find(load => load.kind === kind), given = found?.[key] ?? (kind === "snow" && loads.length ? "" : elements[kind].defaultValue);
    elements[kind].value = typeof given === "number" ? `${given} ${elements[kind].dataset.unit}` : words(given);
    if (found && isWrong("load", found)) first = elements[kind];
  }
  const row = (noun, table, text) => {
    const remove = make("button", { type: "button", textContent: "\u00d7", ariaLabel: `Remove ${noun} ${words(table.name)}`, onclick: () => { dropped.push(table); item.remove(); } });
    const item = make("li", { textContent: `${text} ` }, remove);
    if (isWrong(noun, table)) { item.className = "wrong"; first = remove; }
    return item;
  };
  const others = loads.filter(load => !EDITED.some(([kind]) => loads.find(other => other.kind === kind) === load));
  dropped = [];
  byId("other-loads").replaceChildren(...others.map(load => {
    const { name, kind, ...values } = load;
    return row("load", load, `${words(name)} (${words(kind)?.replaceAll("_", " ")}): ${Object.entries(values).map(([key, value]) => `${key} ${words(value)}`).join(", ")}`);
  }));
  const combined = tablesIn(base.combinations);
  byId("combined").replaceChildren(...combined.map(table => row("combination", table, `${words(table.name)}: ${isTable(table.factors) ? Object.entries(table.factors).map(([load, factor]) => `${words(factor)} \u00d7 ${load}`).join(" + ") : words(table.factors)}`)));
  byId("kept-loads").hidden = !others.length && !combined.length;
  const unread = ["loads", "combinations"].filter(key => base[key] !== undefined && !(Array.isArray(base[key]) && base[key].every(isTable)));
  byId("unread-loads").textContent = unread.map(key => `The case's ${key} cannot be read and go with Check: ${JSON.stringify(base[key])}. `).join("");
  byId("load-values").showModal();
  first?.focus();
}
let dropped = [];  // tables of the case that the dialog is to remove

function checkLoads(elements) {
  const [lost, left] = ["loads", "combinations"].map(name => dropped.map(table => base[name]?.indexOf?.(table) ?? -1));
  change(next => {
    next.combinations = tablesIn(next.combinations?.filter?.((_, k) => !left.includes(k)));
    const gone = lost.map(k => next.loads?.[k]).filter(isTable);
    next.loads = tablesIn(next.loads);
    for (const load of gone) removeLoad(next, load);
    for (const [kind, key] of EDITED) setLoad(next, kind, elements[kind].value.trim(), key);
    if (!next.loads.length) { delete next.loads; delete next.combinations; }
  });
}

// Set the first load of a kind to a text, or remove it (""); a new one comes with its usual combination and the own weight.
function setLoad(next, kind, text, key = "value") {
  next.loads = tablesIn(next.loads);
  next.combinations = tablesIn(next.combinations);
  let load = next.loads.find(load => load.kind === kind);
  if (!text) return load && removeLoad(next, load);
  load ||= addUsual(next, kind);
  load[key] = text;
}

function addUsual(next, kind) {
  const free = (plain, rows) => { while (rows.some(({ name }) => name === plain)) plain += "_"; return plain; };
  const { loads, combinations } = start.usual, usual = loads.find(load => load.kind === kind), load = { ...usual, name: free(usual.name, next.loads) };
  if (![...next.loads, load].some(({ kind }) => kind === "self_weight")) addUsual(next, "self_weight");
  next.loads.push(load);
  const named = plain => (plain === usual.name ? load : next.loads.find(({ kind }) => kind === "self_weight")).name;
  const { name, factors } = combinations.find(({ factors }) => Object.keys(factors).at(-1) === usual.name);
  next.combinations.push({ name: free(name, next.combinations), factors: Object.fromEntries(Object.entries(factors).map(([plain, factor]) => [named(plain), factor])) });
  return load;
}

// A combination that is left with the own weight alone, or with nothing, goes with the load, unless it is the last one.
function removeLoad(next, load) {
  next.loads = next.loads.filter(other => other !== load);
  const heavy = name => next.loads.some(other => other.name === name && other.kind === "self_weight");
  const touched = next.combinations.filter(({ factors }) => isTable(factors) && load.name in factors);
  if (!next.loads.some(({ name }) => name === load.name)) for (const { factors } of touched) delete factors[load.name];
  const idle = touched.filter(({ factors }) => Object.keys(factors).every(heavy)), rest = next.combinations.filter(table => !idle.includes(table));
  next.combinations = rest.length ? rest : next.combinations.filter(({ factors }) => isTable(factors) && Object.keys(factors).length).slice(0, 1);
  if (!next.combinations.length && next.loads.length) next.combinations.push({ name: "service", factors: Object.fromEntries(next.loads.map(({ name }) => [name, 1])) });
}

// For what a verdict holds, in words; "": for no load.
const loadsOf = ({ loads }) => tablesIn(loads).map(({ kind, value }) => `${words(kind)?.replaceAll("_", " ")}${value === undefined ? "" : ` ${typeof value === "number" ? `${short(value / 1000)} kN/m2` : words(value)}`}`).join(", ");

function wireTools() {
  byId("refine").onclick = () => change(next => set(next, "refine.vary", get(next, "refine.vary")?.length ? undefined : ["taper"]));
  byId("upright").onclick = () => {
    change(next => set(next, "target.up", yIsUp(next) ? "z" : "y"));
    buildControls();
  };
  byId("erection").onclick = () => change(next => set(next, "checks.stages", (get(next, "checks.stages") ?? DEPLOYMENT) ? 0 : DEPLOYMENT));
  const dialog = byId("load-values"), form = dialog.querySelector("form");
  byId("loads").onclick = () => showLoads();
  form.onsubmit = ({ submitter }) => {
    if (submitter.value === "check") checkLoads(form.elements);
    if (submitter.value === "without") change(next => { delete next.loads; delete next.combinations; });
  };
}

function post() {
  if (!waiting || !ready || socket.readyState !== WebSocket.OPEN) return;
  const text = JSON.stringify(waiting), size = new Blob([text]).size;
  waiting = null;
  if (size <= start.largest) socket.send(text);
  else failed(`The case has ${short(size / 1e6)} MB, and the studio reads ${short(start.largest / 1e6)} MB at most: make it smaller`);
}

function order(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/api/sessions/${session}/live`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => (typeof data === "string" ? hear(JSON.parse(data)) : see(data));
  socket.onclose = async ({ code, reason }) => {
    ready = false;
    if (code === 4404) { localStorage.removeItem("rodshell-session"); return open(); }
    const answer = code === 4429 || await fetch("/api/version").catch(() => undefined);
    if (answer?.ok === false) return say((await answer.json()).sentence, true);  // trying again would not help
    say(reason || "The server does not answer; trying again", true);
    setTimeout(connect, code === 4429 ? 10 * TIMEOUT : TIMEOUT);
  };
}

async function open() {
  session = localStorage.getItem("rodshell-session");
  if (!session) {
    const answer = await fetch("/api/sessions", { method: "POST" });
    if (!answer.ok) return say((await answer.json()).sentence, true);
    session = (await answer.json()).id;
    localStorage.setItem("rodshell-session", session);
  }
  connect();
}

// What the server says

function hear(news) {
  if (news.kind === "session") return restore(news);
  if (news.kind === "history") return showHistory(news);
  if (news.kind === "variants") { history.variants = news.variants; return showVariants(); }
  if (news.kind === "progress" && news.serial === serial) say(`${news.stage}: ${news.detail}`);
  if (news.kind === "taken" && news.case && news.serial !== serial && !(mine(news.serial) && mine(serial))) follow(news);
  if (news.kind === "taken" && news.serial === serial) taken = serial;
  if (news.kind === "stage") {  // of this case, or of one before it of the same drag
    drawn = news.serial === serial || (mine(news.serial) && mine(serial) && news.serial >= shown);
    if (drawn) {
      shown = news.serial;
      facts = news;
      showFacts();
      byId("figures").classList.toggle("old", shown !== serial);
      if (shown !== serial) byId("verdict").classList.add("old");
    }
  }
  if (news.kind === "done" && news.serial === serial) say("");
  if (news.kind === "failed" && news.serial === serial) failed(news.sentence);
  else if (news.kind === "failed" && news.serial <= 0) say(news.sentence, true);  // of files or a variant: the form stands
}

// Another tab of this session has changed the case.
function follow(news) {
  const changed = !same(news.case, base);
  outdate(changed, news.live);
  base = news.case;
  serial = news.serial;
  notice("");
  showHistory(news);
  if (!news.live) remember();
  showTools();
  if (changed) refreshControls();
}

function see(bytes) {
  if (!drawn) return;
  const target = JSON.stringify(base.target ?? null);
  viewer.show(bytes, { keepView: Boolean(viewer.scene) });
  if (shown === serial && !dragging && fitted !== target) { viewer.home(); fitted = target; }
  placeHandles();
}
let fitted = "";  // the target that the view was fitted to: another one is, once it is let go

function restore(state) {
  history = state;
  tab = (state.page ?? tab) % TABS;
  const from = state.cases[state.at], { known } = restore, edited = known && taken !== serial;  // while the server was away
  showHistory({ at: state.at, count: state.cases.length });
  showVariants();
  ready = restore.known = true;
  if (state.after === "step" ? same(from, base) : state.after !== "connect") return;
  const next = state.after === "connect" && edited ? base : (!known && restore.linked) || from || (known ? base : start.first);
  const changed = !known || !same(next, base);
  submit(clone(next), false);  // also an unchanged case: a server that was started again has not found its form yet
  if (!known && restore.linked === undefined) notice(NO_CASE);
  if (changed) refreshControls();
}

function showHistory({ at, count }) {
  byId("undo").disabled = at <= 0;
  byId("redo").disabled = at >= count - 1;
  byId("tries").hidden = count > 2;
}

function say(text, wrong = false) {
  byId("state").textContent = text;
  byId("state").classList.toggle("wrong", wrong);
}

function notice(text) {
  byId("notice").textContent = text;
  byId("notice").hidden = !text;
}

function failed(sentence) {
  say("");
  const box = byId("verdict"), place = named(sentence);
  box.className = "failed";
  box.replaceChildren(make("strong", { textContent: sentence }), ...remedies(sentence).map(([textContent, path, value]) => make("button", { type: "button", textContent, onclick: () => { change(next => set(next, path, value)); buildControls(); } })));
  byId("result").scrollTop = 0;
  if (place) box.append(make("button", { type: "button", textContent: `Go to ${place.name}`, onclick: place.show }));
  document.body.classList.toggle("old", shown !== serial);  // the shapes are those of a case before
}

const UNITS = { mm: 0.001, cm: 0.01, m: 1, in: 0.0254, ft: 0.3048 };
const SMALLEST = 0.001, LARGEST = 1000;  // m, of a surface from a file
const short = number => String(Number(number.toPrecision(3)));

// What a surface from a file often lacks, with the values that it may have: text of a button, key, value.
function remedies(sentence) {
  const wide = /does not state its unit \(it is ([\d.e+-]+) x ([\d.e+-]+) x ([\d.e+-]+) units wide\)/.exec(sentence);
  const size = wide && Math.max(...wide.slice(1));
  if (wide) return Object.entries(UNITS).filter(([, metres]) => SMALLEST <= size * metres && size * metres <= LARGEST).map(([unit, metres]) => [`${unit}: ${wide.slice(1).map(side => short(side * metres)).join(" \u00d7 ")} m`, "target.unit", unit]);
  if (/ point upwards in it\?/.test(sentence)) return ["y", "z"].map(axis => [`${axis} is up`, "target.up", axis]);
  const plane = /by a base plane between z = (\S+) and (\S+) m/.exec(sentence), middle = plane && short((Number(plane[1]) + Number(plane[2])) / 2);
  return plane ? [[`End it at half its height, z = ${middle} m`, "target.base", Number(middle)]] : [];
}

// Where on the page the value stands that a sentence is about: a load ('load 2 ("snow")'), or the field of the key that
// it names first, as in a case file (target.unit) or as an option (--unit).
function named(sentence) {
  const load = /(?:^|\bof )(load|combination) (\d+)\b/.exec(sentence), whole = /^(loads|combinations) =/.exec(sentence);
  if (load) return { name: `${load[1]} ${load[2]}`, show: () => showLoads({ noun: load[1], number: Number(load[2]) }) };
  if (whole) return { name: "loads", show: () => showLoads() };
  const at = text => sentence.search(new RegExp(`(?<![\\w.])${text.replaceAll(".", "\\.")}(?![\\w-]|\\.\\w)`));
  const found = keysOfCase().filter(({ path }) => path.includes("."));
  const first = text => found.map(key => [at(text(key)), key]).filter(([place]) => place >= 0).sort(([a], [b]) => a - b)[0]?.[1];
  const key = (sentence.includes("by a base plane") && found.find(({ path }) => path === "target.base")) || first(({ path }) => path) || first(({ path }) => `--${path.split(".").pop()}`);
  return key && { name: key.path, show: () => goTo(key) };
}

function goTo({ path }) {
  search.value = "";
  showFound();
  const fields = [...byId("controls").querySelectorAll(`[data-path="${path}"]`)], field = fields.at(-1);
  gui.folders.find(({ _title }) => _title === groupOf({ path }))?.open();
  field?.focus();
  field?.scrollIntoView({ block: "center" });
}

function showFacts() {
  document.body.classList.remove("old");
  byId("figures").tBodies[0].replaceChildren(...facts.figures.map(([name, value]) => make("tr", {}, make("th", { textContent: name, scope: "row" }), make("td", { textContent: value }))));
  const box = byId("verdict");
  if (facts.verdict) {
    box.className = facts.verdict.level;
    const reasons = [...facts.verdict.reasons.slice(1), ...facts.facts];
    const under = loadsOf(base);
    box.replaceChildren(make("strong", { textContent: facts.verdict.headline }), make("p", { className: "under", textContent: under ? `Under ${under}` : "Unloaded: no snow and no wind are given" }), make("ul", {}, ...reasons.map(text => make("li", { textContent: text }))));
    const chosen = () => JSON.stringify([resolved, figure("section"), figure("material")]), before = chosenBefore;
    resolved = facts.resolved;
    chosenBefore = chosen();
    if (before !== chosenBefore) refreshControls();
    offer(shown === serial);
  } else if (facts.status !== "converged") box.replaceChildren(make("strong", { textContent: facts.status }));
  document.title = `${facts.name} · rodshell studio`;
  showPlan();
}

let chosenBefore = "";  // what the program chose, as the controls show it

// Controls

let typing = false, stale = false;  // while somebody types or drags in a control it is not made anew

// The keys that the page has a field for: those of a case whose tables are of these kinds.
function keysOfCase() {
  const kinds = { target: base.target?.kind || "hemisphere", layout: base.layout?.kind || "chebyshev", "rod.section": base.rod?.section?.kind || "circle", joint: base.joint?.kind || "ball", bracing: base.bracing?.kind || "none", "bracing.section": base.bracing?.section?.kind || "circle" };
  const braced = kinds.bracing !== "none";
  return start.keys.filter(key => !key.reads_file && key.path !== "drape.frames" && (braced || !/^bracing\.(section|material)/.test(key.path)) && (!key.kinds.length || key.kinds.includes(kinds[key.path.replace(/\.[^.]*$/, "")])));
}

function buildControls() {
  const focused = document.activeElement?.dataset.path;
  typing = stale = false;  // before the focused field goes, whose loss of focus would ask for controls again
  const open = gui ? gui.foldersRecursive().filter(folder => !folder._closed).map(folder => folder._title) : ["Design"];
  gui?.destroy();
  const file = get(base, "target.file");
  gui = new GUI({ container: byId("controls"), injectStyles: false, title: file ? `Case of ${words(file).replace("upload:", "")}` : "Case" });
  const known = keysOfCase();
  const design = gui.addFolder("Design");
  addLattices(design);
  for (const [path, name, kind] of SLIDERS) {
    if (!known.some(key => key.path === path)) continue;
    addSlider(design, path, name, kind);
  }
  addMaterial(design);
  addSection(design);
  for (const kind of Object.keys(MOST)) addLoad(design, kind);
  addKey(design, known.find(({ path }) => path === "bracing.kind"), "Bracing", (next, kind) => { if (kind === "cables") Object.assign(next.bracing, clone(CABLES), /[\d.]+/.exec(figure("section"))?.[0] <= THIN ? { section: THIN_CABLE } : {}); });
  for (const [path, name] of FIRST) addKey(design, known.find(key => key.path === path), name);
  design.domElement.after(searching);
  const inTables = known.filter(key => key.path.includes("."));
  for (const table of new Set(inTables.map(tableOf))) {
    const keys = inTables.filter(key => tableOf(key) === table), folder = gui.addFolder(groupOf(keys[0]));
    for (const key of keys) addKey(folder, key);
    folder.close();
  }
  for (const folder of gui.foldersRecursive()) if (open.includes(folder._title)) folder.open();
  if (search.value) showFound();
  if (focused) byId("controls").querySelector(`[data-path="${focused}"]`)?.focus();
}

// Settings whose name, group, key or help has all words that are searched for; without words all, in closed groups.
const search = make("input", { type: "search", placeholder: "Search all settings", ariaLabel: "Search all settings", oninput: () => showFound() });
const nothing = make("p", { textContent: "No setting has these words.", hidden: true });
const searching = make("div", { className: "search" }, search, nothing);
search.dataset.path = "search";

function showFound() {
  const wanted = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (const folder of gui.folders.slice(1)) {
    const found = folder.controllers.filter(controller => {
      const hit = wanted.every(word => `${folder._title} ${controller._name} ${controller.domElement.title}`.toLowerCase().includes(word));
      controller.show(hit);
      return hit;
    });
    count += found.length;
    folder.show(found.length > 0);
    folder.open(wanted.length > 0 && found.length > 0);
  }
  nothing.hidden = count > 0;
}

// Lattices as pictures; the one whose rods are given is shown only where a case has it.
function addLattices(folder) {
  const now = base.layout?.kind || "chebyshev", families = get(base, "layout.families") ?? 2;
  folder.$children.prepend(make("div", { className: "lattices", role: "group", ariaLabel: "Lattice" }, ...LATTICES.filter(([kind]) => kind !== "curves" || kind === now).map(([kind, count, name, rods, angles, title]) => {
    const picture = drawn2d("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, ...angles.map((angle, k) => drawn2d("path", { d: rods, transform: `rotate(${angle} 12 12)`, class: "uvw"[k] })));
    const button = make("button", { type: "button", ariaPressed: String(kind === now && (kind !== "geodesic" || count === families)), title, onclick: () => {
      change(next => {
        forget(next, "layout.kind", kind);
        set(next, "layout.kind", kind);
        set(next, "layout.families", count === 3 ? count : undefined);
      });
      setTimeout(buildControls);
    } }, picture, make("span", { textContent: name }));
    button.dataset.path = `${kind} ${count}`;
    return button;
  })));
}

const figure = name => (resolved ? facts?.figures.find(([one]) => one === name)?.[1] : undefined);  // of this target
const materialOf = () => get(base, "rod.material.preset") || (isTable(base.rod?.material) ? "" : figure("material")) || "";

// Another material brings its own sections: one that it is not sold in is left to be chosen.
function addMaterial(folder) {
  addKey(folder, start.keys.find(({ path }) => path === "rod.material.preset"), "Material", (next, preset) => {
    const sold = start.sold[preset] || [];
    if (sold.length && !sold.includes(sectionGiven())) set(next, "rod.section", undefined);
  });
}

// The section that the case gives, as the trade calls it; "": it is chosen to fit.
function sectionGiven() {
  const given = get(base, "rod.section"), sizes = isTable(given) ? Object.entries(given).filter(([name]) => name !== "kind") : [];
  if (typeof given === "string") return (start.sold[materialOf()] || []).includes(given) ? given : figure("section") || given;
  return sizes.length && !sizes.some(([, size]) => size === "auto") ? figure("section") || "as given" : "";
}

function addSection(folder) {
  const given = sectionGiven(), sizes = new Set([...(start.sold[materialOf()] || []), ...(given ? [given] : [])]), fit = !given && figure("section");
  const holder = { value: given }, choices = { [fit ? `fits: ${fit}` : "chosen to fit"]: "", ...Object.fromEntries([...sizes].map(size => [size, size])) };
  const controller = folder.add(holder, "value", choices).name("Section");
  controller.onFinishChange(() => change(next => set(next, "rod.section", holder.value)));
  describe(controller, "rod.section", "sections in which the material is sold; any other one: in words, below");
}

// Snow and wind: the first load of its kind, which comes with its usual combination where the case has none.
function addLoad(folder, kind) {
  const found = tablesIn(base.loads).filter(load => load.kind === kind), unread = base.loads !== undefined && !Array.isArray(base.loads);
  const given = found[0]?.value, text = /^\s*([\d.]+)\s*(kN\/m2|kPa)\s*$/.exec(given)?.[1], pascals = tablesIn(resolved?.loads).find(load => load.kind === kind)?.value;
  const now = !found.length ? 0 : text ? Number(text) : (typeof given === "number" ? given : pascals) / 1000;
  if (unread || found.length > 1 || !Number.isFinite(now)) return;  // the dialog has them
  const holder = { value: now };
  const controller = folder.add(holder, "value", 0, Math.max(MOST[kind], 2 * now), 0.05).name(`${kind === "snow" ? "Snow" : "Wind"} [kN/m2]`);
  controller.onFinishChange(() => change(next => {
    setLoad(next, kind, holder.value ? `${holder.value} kN/m2` : "");
    const [own, ...others] = next.loads;
    if (!own || (!others.length && own.kind === "self_weight" && !own.cladding)) { delete next.loads; delete next.combinations; }
  }));
  describe(controller, `loads.${kind}`, kind === "snow" ? "snow on the plan; with 1.35 times the own weight and 1.5 times the snow" : "velocity pressure of the wind, from four sides; with the own weight and 1.5 times the wind");
}

function value(path) {
  const raw = get(base, path);
  if (typeof raw === "number") return raw;
  const known = get(resolved, path);
  if (path === "layout.spacing" && Array.isArray(known)) return known[0];
  return typeof known === "number" ? known : Array.isArray(raw) ? raw[0] : NaN;
}

function addSlider(folder, path, name, kind) {
  const now = value(path);
  if (!Number.isFinite(now)) return;
  const turned = kind === "angle" || kind === "crossing";
  const [symbol, unit] = unitOf(start.keys.find(key => key.path === path));
  const size = (facts?.handles?.size || 1) * unit;
  const [low, high] = range(path, now * unit, kind === "angle" ? [-90, 90] : kind === "crossing" ? [30, 150] : kind === "place" ? [now * unit - 0.5 * size, now * unit + 0.5 * size] : [now * unit / 2, now * unit * 2]);
  const given = typeof get(base, path) === "number" ? now * unit : Number((now * unit).toPrecision(4));
  const holder = { value: given };
  const step = turned ? 0.5 : 10 ** Math.floor(Math.log10((high - low) / 400));
  const put = (live) => change(next => {
    set(next, path, turned ? holder.value / unit : Number((holder.value / unit).toPrecision(8)));
  }, live);
  const controller = folder.add(holder, "value", low, high, step).name(symbol ? `${name} [${symbol}]` : name);
  controller.onChange(() => put(true)).onFinishChange(() => put(false));
  describe(controller, path, start.keys.find(key => key.path === path).help);
}

// A slider keeps its range until its value comes near an end of it.
const ranges = new Map();

function range(path, now, wanted) {
  const [low, high] = ranges.get(path) || wanted, near = 0.04 * (high - low);
  ranges.set(path, now < low + near || now > high - near ? wanted : [low, high]);
  return ranges.get(path);
}

// A value of a key as the page shows it, its numbers in the page's units; and what is given when such a text is typed.
function shownValue(value, key) {
  const factor = unitOf(key)[1], scaled = number => (typeof number === "number" ? Number((factor * number).toPrecision(10)) : number);
  return typeof value === "string" ? value : factor !== 1 && Array.isArray(value) && !value.some(Array.isArray) ? value.map(scaled).join(", ") : JSON.stringify(scaled(value));
}

function typedValue(text, key) {
  const factor = unitOf(key)[1], numbers = text.replace(/^\s*\[|\]\s*$/g, "").split(",").map(part => (part.trim() ? Number((Number(part) / factor).toPrecision(10)) : NaN));
  if (factor !== 1 && numbers.every(Number.isFinite)) return numbers.length > 1 ? numbers : numbers[0];
  try { return JSON.parse(text); } catch { return text; }
}

function addKey(folder, key, label = "", also = () => {}) {
  if (!key) return;
  const raw = get(base, key.path), symbol = unitOf(key)[0];
  const text = raw === undefined || isTable(raw) ? "" : shownValue(raw, key);
  const holder = { value: text };
  const name = label || (symbol ? `${nameOf(key)} [${symbol}]` : nameOf(key));
  const given = get(resolved, key.path), shownAs = Array.isArray(given) ? given.join(", ") : String(given ?? "default");
  const choices = { [given === undefined ? "default" : `default: ${shownAs}`]: "", ...Object.fromEntries(key.choices.map(word => [word, String(word)])) };
  const controller = key.choices.length && !key.any_value ? folder.add(holder, "value", choices) : folder.add(holder, "value");
  controller.name(name);
  controller.onFinishChange(() => {
    change(next => {
      if (key.path.endsWith(".kind") || key.path === "rod.material.preset") forget(next, key.path, holder.value);
      set(next, key.path, holder.value === "" ? undefined : typedValue(holder.value, key));
      also(next, holder.value);
    });
    if (key.path.endsWith("kind")) setTimeout(buildControls);
  });
  const input = controller.domElement.querySelector("input");
  if (input && given !== undefined && given !== null) input.placeholder = isTable(given) ? "such as tube 32x3" : typeof given === "number" ? shownValue(Number(given.toPrecision(6)), key) : shownValue(given, key);
  describe(controller, key.path, key.help);
}

// Another kind of a table has other keys: those of the old one go that it does not have, and all of a material.
function forget(next, path, kind) {
  const table = path.replace(/\.[^.]*$/, ""), before = get(next, table);
  const kept = table === "layout" ? start.keys.filter(key => key.path.startsWith("layout.") && key.kinds.includes(kind || "chebyshev")).map(key => key.path.slice(7)) : [];
  set(next, table, Object.fromEntries(Object.entries(isTable(before) ? before : {}).filter(([name]) => kept.includes(name))));
}

function describe(controller, path, help) {
  controller.domElement.title = `${path}: ${help}`;
  for (const input of controller.domElement.querySelectorAll("input, select")) {
    input.setAttribute("aria-label", `${controller._name}: ${help}`);
    input.dataset.path = path;
  }
  for (const part of controller.domElement.querySelectorAll(".lil-slider")) part.setAttribute("aria-hidden", "true");
}

function refreshControls() {
  stale = true;
  if (!typing) buildControls();
}

function settled() {
  typing = false;
  if (stale) setTimeout(refreshControls);
}

// The flat plan

function drawn2d(name, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, text] of Object.entries(attributes)) element.setAttribute(key, text);
  element.append(...children);
  return element;
}

function showPlan() {
  const svg = byId("plan").querySelector("svg"), rods = facts.plan;
  svg.toggleAttribute("hidden", !rods.length);
  const xs = rods.flatMap(({ ends }) => [ends[0], ends[2]]), ys = rods.flatMap(({ ends }) => [-ends[1], -ends[3]]);
  const [left, top] = [Math.min(...xs), Math.min(...ys)], wide = Math.max(...xs) - left, tall = Math.max(...ys) - top;
  if (rods.length) svg.setAttribute("viewBox", `${left - 0.03 * wide} ${top - 0.03 * tall} ${1.06 * wide || 1} ${1.06 * tall || 1}`);
  svg.replaceChildren(...rods.flatMap(({ id, family, ends }) => {
    const at = { x1: ends[0], y1: -ends[1], x2: ends[2], y2: -ends[3] };
    const hit = drawn2d("line", { ...at, class: "hit", tabindex: -1, "data-rod": id, "vector-effect": "non-scaling-stroke" });
    return [drawn2d("line", { ...at, class: family, "data-line": id }), hit];
  }));
  const gone = leftOut();
  byId("left-out").replaceChildren(...(gone.length ? ["Left out: ", ...gone.map(id => make("button", { type: "button", textContent: `${id} \u00d7`, ariaLabel: `Put rod ${id} back`, onclick: () => toggle(id) }))] : []));
  byId("unseam").hidden = !(base.seams?.lines?.length);
  markRod(marked);
}

function leftOut() {
  const names = get(base, "layout.left_out") || [];
  return Array.isArray(names) ? names : String(names).split(",").map(name => name.trim()).filter(Boolean);
}

function toggle(id) {
  const names = leftOut(), rest = names.filter(name => name !== id);
  change(next => set(next, "layout.left_out", rest.length < names.length ? (rest.length ? rest : undefined) : [...names, id]));
}

let marked = "";

function markRod(id) {
  marked = id;
  for (const line of byId("plan").querySelectorAll("line[data-line]")) line.classList.toggle("marked", line.dataset.line === id);
  const rod = facts?.plan.find(one => one.id === id);
  byId("plan").querySelector("figcaption").textContent = rod ? `${id}: cut length ${(1000 * rod.length).toFixed(1)} mm. Click to leave it out.` : facts?.plan.length === 0 ? "These rods do not lie flat as one grid: each is cut by itself, as in the download." : "Point at a rod; a click leaves it out.";
}

// Handles in the scene: a dot for the anchor, a ring with a knob for the heading, a cone each way for the base plane

const handles = { group: null, held: null };

function toScene(point) {
  const { low, size, box } = viewer.scene;
  return new THREE.Vector3(...point.map((value, axis) => (value - low[axis]) / size - box[axis] / 2));
}

function toMetres(place) {
  const { low, size, box } = viewer.scene;
  return ["x", "y", "z"].map((axis, k) => (place[axis] + box[k] / 2) * size + low[k]);
}

function placeHandles() {
  if (handles.group) viewer.world.remove(handles.group);
  handles.group = null;
  const known = facts?.handles;
  if (!known || handles.held) { if (!known) return; }
  const ink = matchMedia("(prefers-color-scheme: dark)").matches ? 0x7db6df : 0x1f5f8b;
  const group = new THREE.Group(), radius = 0.32 * known.size / viewer.scene.size;
  const paint = (colour, always = true) => new THREE.MeshBasicMaterial({ color: colour, depthTest: !always, transparent: true, opacity: 0.92 });
  const dot = new THREE.Mesh(new THREE.SphereGeometry(0.013, 24, 16), paint(0xffffff));
  const rim = new THREE.Mesh(new THREE.SphereGeometry(0.016, 24, 16), paint(ink));
  rim.renderOrder = 8;
  dot.renderOrder = 9;
  const ring = new THREE.Mesh(new THREE.TorusGeometry(radius, 0.0022, 8, 96), paint(ink));
  const knob = new THREE.Mesh(new THREE.SphereGeometry(0.014, 24, 16), paint(ink));
  const turn = typeof known.heading === "number" ? known.heading : 0;
  knob.position.set(radius * Math.cos(turn), radius * Math.sin(turn), 0);
  for (const part of [ring, knob]) part.renderOrder = 7;
  group.add(rim, dot, ring, knob);
  const centre = toScene(known.anchor), plane = known.base && new THREE.Group();
  if (plane) {
    for (const way of [1, -1]) {
      const cone = new THREE.Mesh(new THREE.ConeGeometry(0.013, 0.03, 20), paint(ink));
      cone.rotation.x = way * Math.PI / 2;
      cone.position.z = way * 0.021;
      cone.renderOrder = 7;
      plane.add(cone);
    }
    plane.position.copy(toScene(known.base)).sub(centre);
    group.add(plane);
  }
  group.position.copy(centre);
  Object.assign(handles, { group, dot, knob, plane });
  viewer.world.add(group);
  viewer.redraw();
  requestAnimationFrame(tellHandles);
}

function onScreen(object) {
  const frame = viewer.canvas.getBoundingClientRect(), place = object.getWorldPosition(new THREE.Vector3()).project(viewer.camera);
  return [(0.5 + 0.5 * place.x) * frame.width + frame.left, (0.5 - 0.5 * place.y) * frame.height + frame.top];
}

const screenDistance = (object, { clientX, clientY }) => Math.hypot(...onScreen(object).map((value, axis) => value - [clientX, clientY][axis]));

// Where the handles are in the window [px], for whoever drives the page by a program.
function tellHandles() {
  const parts = handles.group ? { anchor: handles.dot, heading: handles.knob, base: handles.plane } : {};
  byId("view").dataset.handles = JSON.stringify(Object.fromEntries(Object.entries(parts).filter(([, part]) => part).map(([name, part]) => [name, onScreen(part)])));
}

function ray(event) {
  const frame = viewer.canvas.getBoundingClientRect(), caster = new THREE.Raycaster();
  caster.setFromCamera(new THREE.Vector2(2 * (event.clientX - frame.left) / frame.width - 1, 1 - 2 * (event.clientY - frame.top) / frame.height), viewer.camera);
  return caster;
}

function onTarget(event) {
  const surface = viewer.target();
  return surface ? ray(event).intersectObject(surface)[0]?.point : null;
}

function wireHandles() {
  const canvas = viewer.canvas;
  viewer.orbit.addEventListener("change", () => requestAnimationFrame(tellHandles));
  canvas.addEventListener("pointerdown", event => {
    if (!handles.group || drawing) return;
    handles.held = [["anchor", "dot"], ["heading", "knob"], ["base", "plane"]].find(([, part]) => handles[part] && screenDistance(handles[part], event) < 16)?.[0];
    if (!handles.held) return;
    viewer.orbit.enabled = false;
    canvas.setPointerCapture(event.pointerId);
    event.stopImmediatePropagation();
  }, true);
  canvas.addEventListener("pointermove", event => { if (handles.held) dragged(event, true); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, event => {
    if (!handles.held) return;
    dragged(event, false);
    handles.held = null;
    viewer.orbit.enabled = true;
    event.stopImmediatePropagation();
  }, true);
}

function dragged(event, live) {
  const centre = handles.group.position;
  if (handles.held === "anchor") {
    const place = onTarget(event);
    if (place) handles.last = toMetres(place).slice(0, 2).map(value => Number(value.toPrecision(6)));
    if (handles.last) change(next => set(next, "drape.anchor", handles.last), live);
  } else if (handles.held === "base") {
    const at = handles.plane.getWorldPosition(new THREE.Vector3()), facing = viewer.camera.position.clone().sub(at).setZ(0).normalize();
    const wall = new THREE.Plane().setFromNormalAndCoplanarPoint(facing, at), place = ray(event).ray.intersectPlane(wall, new THREE.Vector3());
    if (place) handles.level = Number(toMetres(place)[2].toPrecision(4));
    if (handles.level !== undefined) change(next => set(next, "target.base", handles.level), live);
  } else {
    const level = new THREE.Plane(new THREE.Vector3(0, 0, 1), -centre.z), place = ray(event).ray.intersectPlane(level, new THREE.Vector3());
    if (place) handles.turn = Number(Math.atan2(place.y - centre.y, place.x - centre.x).toFixed(4));
    if (handles.turn !== undefined) change(next => set(next, "layout.rotate", handles.turn), live);
  }
}

// Seams, drawn on the target

let drawing = null;

function startSeam() {
  drawing = drawing ? null : [];
  byId("seam").setAttribute("aria-pressed", String(Boolean(drawing)));
  say(drawing ? "Click points of the seam on the target; Enter ends it, Escape forgets it" : "");
}

function endSeam() {
  const points = drawing;
  drawing = null;
  byId("seam").setAttribute("aria-pressed", "false");
  say("");
  if (points.length < 2) return;
  change(next => {
    const lines = Array.isArray(next.seams?.lines) ? next.seams.lines : [];
    set(next, "seams.lines", [...lines, points]);
    set(next, "layout.rods", undefined);
    set(next, "layout.length", undefined);
    set(next, "drape.anchor", undefined);
  });
}

// Variants

function showVariants() {
  const checked = chosen().map(({ name }) => name);
  byId("variants").querySelector("ul").replaceChildren(...history.variants.map(({ name, verdict, case: kept }) => make("li", {},
    make("input", { type: "checkbox", name: "variant", value: name, checked: checked.includes(name), ariaLabel: `Compare ${name}`, onchange: compared }),
    make("span", { textContent: name, className: verdict.level, title: verdict.headline }),
    make("button", { type: "button", textContent: "Open", ariaLabel: `Open ${name}`, onclick: () => { submit(clone(kept), false); buildControls(); } }),
    make("button", { type: "button", textContent: "\u00d7", ariaLabel: `Forget ${name}`, onclick: () => order({ kind: "drop", name }) }))));
  compared();
}

function chosen() {
  const names = [...byId("variants").querySelectorAll("input:checked")].map(({ value }) => value);
  return history.variants.filter(({ name }) => names.includes(name));
}

function compared() { byId("compare").disabled = chosen().length !== 2; }

async function compare() {
  const pair = chosen(), dialog = byId("side"), both = dialog.querySelector(".both");
  dialog.showModal();
  both.replaceChildren();
  const views = [];
  for (const { name, scene } of pair) {
    const host = make("div", {});
    both.append(make("section", {}, make("h2", { textContent: name }), host));
    const view = createViewer(host);
    view.show(await (await fetch(`/api/sessions/${session}/scenes/${scene}`)).arrayBuffer());
    views.push(view);
  }
  let leading = null;
  views.forEach((view, k) => view.orbit.addEventListener("change", () => {  // one camera
    if (leading) return;
    leading = view;
    const other = views[1 - k];
    other.camera.position.copy(view.camera.position);
    other.orbit.target.copy(view.orbit.target);
    other.orbit.update();
    other.redraw();
    leading = null;
  }));
  const rows = [["verdict", ...pair.map(({ verdict }) => verdict.headline)], ["loads", ...pair.map(kept => loadsOf(kept.case) || "unloaded")]], names = [...new Set(pair.flatMap(({ figures }) => figures.map(([name]) => name)))];
  for (const name of names) rows.push([name, ...pair.map(({ figures }) => figures.find(([one]) => one === name)?.[1] ?? "\u2013")]);
  for (const key of start.keys) {
    if (/^(loads|combinations|rod\.section|rod\.material)/.test(key.path)) continue;  // are among the figures
    const symbol = unitOf(key)[0], [a, b] = pair.map(({ case: kept }) => get(kept, key.path));
    const said = value => (value === undefined ? "default" : `${shownValue(value, key)}${symbol && typeof value !== "string" ? ` ${symbol}` : ""}`);
    if (!same(a, b)) rows.push([`${groupOf(key)}: ${nameOf(key)}`, said(a), said(b)]);
  }
  rows.sort(([, a, b], [, c, d]) => (a === b) - (c === d));  // what differs comes first
  dialog.querySelector("tbody").replaceChildren(...rows.map(([name, a, b]) => make("tr", {}, make("th", { textContent: name, scope: "row" }), ...[a, b].map(text => make("td", { textContent: text, className: a === b ? "" : "differs" })))));
  dialog.addEventListener("close", () => views.forEach(view => view.dispose()), { once: true });
}

// Links: the whole case, compressed, behind the # of the address

async function packed(text) {
  const stream = new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  return btoa(Array.from(bytes, byte => String.fromCharCode(byte)).join("")).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

async function unpacked(code) {
  const bytes = Uint8Array.from(atob(code.replaceAll("-", "+").replaceAll("_", "/")), letter => letter.charCodeAt(0));
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader(), parts = [];
  let size = 0;
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    parts.push(part.value);
    size += part.value.length;
    if (size > start.largest) throw new RangeError();
  }
  return new Blob(parts).text();
}

// The case in the address; null: there is none; undefined: it cannot be read.
async function fromAddress() {
  const code = new URLSearchParams(location.hash.slice(1)).get("case");
  const found = code === null ? null : await unpacked(code).then(JSON.parse).then(clone).catch(() => undefined);  // clone: it may nest too deep to be written
  return code === null || isTable(found) ? found : undefined;
}

async function openLink() {
  const found = await fromAddress();
  if (!restore.known) restore.linked = found;
  else if (found === undefined) notice(NO_CASE);
  else if (found) {
    submit(found, false);
    buildControls();
  }
}

async function remember() {
  const code = await packed(JSON.stringify(base));
  window.history.replaceState(null, "", `${location.pathname}#case=${code}`);
}

function script() {
  const text = (facts?.case || "").replaceAll("\\", "\\\\").replaceAll('"""', '\\"""');
  return `import rodshell as rs\n\njob = rs.Job.load("""\n${text}""")\nform = job.run(progress=rs.bar)\nprint(form.verdict.headline)\nform.save("out")\n`;
}

// Whether curves can end the target: only one from a file.
const takesOutline = () => start.keys.find(({ path }) => path === "target.boundary").kinds.includes(base.target?.kind);

// Send a file that holds a surface, which becomes the target, or an outline, which ends the target that there is.
async function upload(file, asOutline = false) {
  const suffix = `.${file.name.toLowerCase().split(".").at(-1)}`, outline = asOutline || (start.outlines.includes(suffix) && !start.surfaces[suffix]);
  if (outline && !takesOutline()) return say(`${file.name} holds curves, which end a surface from a file: upload the surface first`, true);
  say(`Sending ${file.name}`);
  const address = `/api/sessions/${session}/uploads?name=${encodeURIComponent(file.name)}`;
  const answer = await fetch(address, { method: "POST", body: file }).catch(() => undefined);
  const said = await answer?.json().catch(() => undefined);
  if (!said) return say(`${file.name} was not sent, since the connection to rodshell studio failed: choose it again`, true);
  if (!answer.ok) return say(said.sentence, true);
  if (get(base, outline ? "target.boundary" : "target.file") === said.file) { fitted = ""; submit(clone(base), false); outdate(true, false); }  // a new state of the same file
  else if (outline) change(next => set(next, "target.boundary", said.file));
  else submit({ target: { kind: start.surfaces[suffix], file: said.file } }, false);
  buildControls();
}

// The page

function wire() {
  byId("preset").replaceChildren(make("option", { value: "", textContent: "a built-in case" }), ...Object.keys(start.presets).map(name => make("option", { value: name, textContent: name })));
  byId("preset").onchange = ({ target }) => {
    if (!target.value) return;
    submit(clone(start.presets[target.value]), false);
    target.value = "";
    buildControls();
  };
  byId("upload").onclick = () => byId("file").click();
  byId("file").accept = Object.keys(start.surfaces).join(",");
  byId("outline").onclick = () => byId("outline-file").click();
  byId("outline-file").accept = start.outlines.join(",");
  for (const [name, asOutline] of [["file", false], ["outline-file", true]]) {
    byId(name).onchange = ({ target }) => { if (target.files[0]) upload(target.files[0], asOutline); target.value = ""; };
  }
  byId("no-outline").onclick = () => change(next => set(next, "target.boundary", undefined));
  addEventListener("dragover", event => event.preventDefault());
  addEventListener("drop", event => { event.preventDefault(); if (event.dataTransfer.files[0]) upload(event.dataTransfer.files[0]); });
  byId("undo").onclick = () => order({ kind: "step", by: -1 });
  byId("redo").onclick = () => order({ kind: "step", by: 1 });
  byId("link").onclick = async () => { await remember(); await navigator.clipboard?.writeText(location.href).catch(() => {}); say("The link is copied: it holds the whole case"); };
  byId("python").onclick = () => {
    const files = [get(base, "target.file"), get(base, "target.boundary")].filter(Boolean).map(name => name.replace("upload:", ""));
    byId("needs").textContent = files.length ? `Run it in a folder with ${files.join(" and ")}; the download has it in inputs/.` : "";
    byId("script").querySelector("pre").textContent = script(); byId("script").showModal();
  };
  for (const dialog of document.querySelectorAll("dialog")) dialog.querySelector(":scope > button")?.addEventListener("click", () => dialog.close());
  wireTools();
  const controls = byId("controls");
  for (const begin of ["input", "pointerdown"]) controls.addEventListener(begin, () => { typing = true; });
  for (const end of ["change", "focusout"]) controls.addEventListener(end, settled);
  addEventListener("pointerup", ({ target }) => { if (!target.closest?.("input, select")) settled(); });
  controls.addEventListener("keydown", ({ key, target }) => {  // Enter takes the focus away: Tab would begin anew
    const { path } = target.dataset;
    if (key === "Enter" && path) setTimeout(() => controls.querySelector(`[data-path="${path}"]`)?.focus());
  }, true);  // lil-gui lets no key through
  byId("seam").onclick = startSeam;
  byId("unseam").onclick = () => change(next => set(next, "seams.lines", undefined));
  byId("keep").onsubmit = event => { event.preventDefault(); order({ kind: "keep", name: byId("name").value || facts?.name || "variant" }); byId("name").value = ""; };
  byId("compare").onclick = compare;
  addEventListener("keydown", event => {
    if (drawing && event.key === "Enter") { event.preventDefault(); endSeam(); }
    if (drawing && event.key === "Escape") { drawing = []; startSeam(); }
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z" && !(typing && event.target.closest("input"))) {
      event.preventDefault();
      order({ kind: "step", by: event.shiftKey ? 1 : -1 });
    }
  }, true);
  const plan = byId("plan");
  plan.addEventListener("pointerover", ({ target }) => { const id = target.dataset?.rod; if (id) { markRod(id); viewer.select("rod", id); } });
  plan.addEventListener("click", ({ target }) => { if (target.dataset?.rod) toggle(target.dataset.rod); });
  viewer.on("hover", found => { if (found) markRod(found.kind === "rod" ? found.id : found.id.split("/")[0]); });
  viewer.on("pick", found => markRod(found?.kind === "rod" ? found.id : found?.id.split("/")[0]));
  viewer.canvas.addEventListener("click", event => {
    const place = drawing && onTarget(event);
    if (place) { drawing.push(toMetres(place).slice(0, 2).map(value => Number(value.toPrecision(5)))); say(`${drawing.length} points; Enter ends the seam`); }
  });
  markRod("");
}

viewer = createViewer(byId("view"));
const answer = await fetch("/api/start");
if (answer.ok) {
  start = await answer.json();
  await openLink();
  addEventListener("hashchange", openLink);
  wire();
  wireHandles();
  await open();
} else notice((await answer.json()).sentence);
