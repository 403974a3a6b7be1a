// Put the page together when it opens.

/** Whether the loops compute what `simulate` recorded, to the last bit. */
function showBadge(app) {
  const badge = byId("badge");
  const checked = app.loops.map((loop, k) => ({ loop, k, found: loop.facts.vector ? loop.check() : null }));
  const right = (each) => (each.loop.facts.plain ? each.found.same : each.found.same || each.found.close);
  const wrong = checked.find((each) => each.found && !right(each));
  const compared = checked.filter((each) => each.found);
  const hash = app.payload.hash ? ` \u00b7 ${app.payload.hash}` : "";
  if (!compared.length) {
    badge.hidden = true;
    return;
  }
  const plain = compared.every((each) => each.loop.facts.plain);
  const samples = compared.reduce((sum, each) => sum + each.found.samples, 0);
  if (wrong) {
    badge.className = "badge bad";
    badge.textContent = `\u2717 not the run of simulate${hash}`;
    const { at, signal } = wrong.found;
    badge.title = `${app.payload.loops[wrong.k].title}: ${signal || "a value"} differs at sample ${at}. Do not trust this page.`;
    byId("bits").textContent = badge.title;
  } else {
    badge.className = `badge ${plain ? "good" : "mild"}`;
    badge.textContent = plain ? `\u2713 same bits as simulate${hash}` : `\u2248 same run as simulate, to its tolerance${hash}`;
    byId("bits").textContent = plain
      ? `When this page opened it ran ${samples} recorded samples of simulate again: every bit is the same.`
      : app.loops.some((loop) => loop.facts.kind === "sampled")
        ? `The loop computes with fused multiply-add, which a browser does not have: the page runs the same loop up to rounding (${samples} samples compared). With Hardware(arithmetic=Plain()) every bit is the same.`
        : `A loop without a processor is stepped here by a method of its own; it agreed with ${samples} recorded points of simulate to within its tolerance.`;
  }
  badge.hidden = false;
}

function connect(app) {
  const click = (id, run) => byId(id).addEventListener("click", run);
  click("play", () => (app.clock.playing ? app.pause() : app.play()));
  click("single", () => app.single());
  click("back-1", () => app.rewind(1));
  click("back-10", () => app.rewind(10));
  click("restart", () => app.restart());
  click("ended-restart", () => { app.restart(); app.play(); byId("play").focus(); });
  click("slow-button", () => app.setSpeed(app.clock.possible));
  click("csv", () => save(new Blob([toCsv(app)], { type: "text/csv" }), fileName(app.payload.title, "csv")));
  click("png", () => toImage(app).toBlob((blob) => save(blob, fileName(app.payload.title, "png"))));
  click("copy", async () => {
    try {
      history.replaceState(null, "", `#${toAddress(app)}`);
      await navigator.clipboard.writeText(location.href);
      app.say("The address of this state is copied.");
    } catch {
      app.say("Copy the address from the browser's address line: it holds this state.");
    }
  });
  byId("past").addEventListener("input", (event) => app.seek(Number(event.target.value)));
  byId("speed").addEventListener("change", (event) => app.setSpeed(Number(event.target.value)));
  byId("window").addEventListener("change", (event) => { app.curves.window = Number(event.target.value); app.noteAddress(); app.changed(); });
  document.addEventListener("keydown", (event) => keys(app, event));
  const down = new Set();
  const hold = (event, place) => {
    const key = event.key.toLowerCase();
    const run = app.controls.keys?.get(key);
    if (!run || event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input[type=number], select")) return;
    if (down.has(key) === (place === 1)) run[place]();
    if (place) down.delete(key);
    else down.add(key);
  };
  document.addEventListener("keydown", (event) => hold(event, 0));
  document.addEventListener("keyup", (event) => hold(event, 1));
  window.addEventListener("blur", () => { for (const key of down) app.controls.keys.get(key)[1](); down.clear(); });
  window.addEventListener("hashchange", () => { fromAddress(app, location.hash); app.restart(); });
  new ResizeObserver(() => app.resize()).observe(byId("stage"));
  new ResizeObserver(() => app.resize()).observe(byId("curves"));
  for (const query of ["(prefers-color-scheme: dark)", "print"]) matchMedia(query).addEventListener("change", () => app.restyle());
  document.addEventListener("visibilitychange", () => app.changed());
  for (const fold of document.querySelectorAll("details")) fold.addEventListener("toggle", () => app.resize());
}

function keys(app, event) {
  if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
  if (event.target.closest("input, select, textarea, summary") || (event.key === " " && event.target.closest("button"))) return;
  const run = {
    " ": () => (app.clock.playing ? app.pause() : app.play()),
    ".": () => app.single(),
    ",": () => app.rewind(1),
    r: () => app.restart(),
    l: () => app.load && app.toggleLoad(),
  }[event.key];
  if (!run) return;
  event.preventDefault();
  run();
}

function fillChoices(app) {
  const names = app.signals[0].filter((signal) => signal.kind !== "disturbance" || !app.inputRows.some((row) => row.push && row.name === signal.name));
  for (const signal of names) {
    const box = toggle(signal.name, labelOf(signal), app.curves.names.includes(signal.name), (on) => {
      const chosen = on ? [...app.curves.names, signal.name] : app.curves.names.filter((name) => name !== signal.name);
      if (!chosen.length) {
        box.set(true);
        return;
      }
      app.curves.show(chosen);
      app.noteAddress();
    });
    byId("curve-choice").append(box.root);
  }
  if (!app.plane) {
    byId("plane-card").hidden = true;
    return;
  }
  const pairs = app.loops[0].facts.states.map((s) => [s.name, labelOf(s)]);
  const take = () => {
    if (x.value === y.value) return;
    app.plane.axes(x.value, y.value);
    app.noteAddress();
    app.changed();
  };
  const x = choice("Horizontal axis", pairs, app.plane.x, take);
  const y = choice("Vertical axis", pairs, app.plane.y, take);
  const field = toggle("arrows", "plant's own motion", app.plane.arrows, (on) => { app.plane.arrows = on; app.changed(); });
  byId("plane-axes").append(el("span", { class: "quiet" }, "across"), x, el("span", { class: "quiet" }, "up"), y, app.replay ? "" : field.root);
  const notes = [];
  if (app.payload.equilibria.length) notes.push("Discs are equilibria, filled where stable.");
  if (app.payload.region) notes.push(app.payload.region.text);
  if (!app.replay) notes.push("Click, or use the arrow keys and Enter, to start from a point.");
  byId("plane-note").textContent = notes.join(" ");
}

/** Poles as people write them: the slowest first, pairs as one, what differs by rounding alone as the same. */
function poleText(poles) {
  const rows = poles.map(([re, im]) => {
    const size = Math.hypot(re, im), [a, b] = [re, im].map((part) => (Math.abs(part) < 3e-3 * size ? 0 : part));
    return { re: a, im: b };
  }).filter(({ im }) => im >= 0).sort((one, other) => other.re - one.re || one.im - other.im);
  const texts = rows.map(({ re, im }) => (im ? `${re ? `${words(re, 3)} ` : ""}\u00b1${re ? " " : ""}${words(im, 3)}i` : words(re, 3)));
  const single = [...new Set(texts)];
  return single.map((text) => {
    const times = texts.filter((each) => each === text).length;
    return times > 1 ? `${text} (${times}\u00d7)` : text;
  }).join(", ");
}

function fillPoles(app) {
  if (!app.poles) {
    byId("poles-card").hidden = true;
    return;
  }
  const several = app.loops.length > 1;
  app.payload.loops.forEach((loop, k) => {
    if (!loop.poles.length) return;
    const text = poleText(loop.poles);
    byId("poles-text").append(el("p", {}, several ? el("span", { class: `swatch s${k % 7}` }, loop.title, ": ") : null, text));
  });
}

function open() {
  const payload = JSON.parse(byId("ulna-data").textContent);
  const app = new App(payload, ulnaPrograms);
  document.querySelector("main").classList.toggle("many", app.loops.length > 2);
  app.controls = new Controls(app);
  app.curves.show(app.usualCurves);
  fromAddress(app, location.hash);
  byId("window").value = app.curves.window;
  for (const part of [1, 0.5, 0.2, 0.1, 0.05, 0.01]) byId("speed").append(el("option", { value: part * app.pace }, speedText(part * app.pace)));
  app.setSpeed(app.clock.speed);
  for (const each of byId("window").options) each.textContent = `${words(Number(each.value) * app.pace)} s`;
  for (const [id, seconds] of [["back-1", 1], ["back-10", 10]]) byId(id).textContent = `${MINUS}${words(seconds * app.pace)} s`;
  for (const each of document.querySelectorAll(".of-load")) each.hidden = !app.load;
  fillChoices(app);
  fillPoles(app);
  connect(app);
  app.restart();
  app.resize();
  showBadge(app);
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches || payload.paused;
  byId("still").hidden = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (still) app.pause();
  else app.play();
  document.body.classList.add("ready");
  window.ulnaPage = app; // for the curious, and for tests
}

open();
