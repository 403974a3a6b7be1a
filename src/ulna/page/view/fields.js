// What a hand can move: sliders with their number, buttons that are held, switches.

/** A slider and a number for one quantity, in its own unit; `set` moves it without telling anybody. */
function slider({ name, item, low, high, value, text, on, reset = null }) {
  const [a, b] = [toShown(item, low), toShown(item, high)];
  const step = niceAbove((b - a) / 400);
  const shownValue = (v) => Number(toShown(item, v).toPrecision(6));
  const id = `f${(slider.count = (slider.count || 0) + 1)}`;
  const box = el("input", { type: "number", id, step: "any", value: shownValue(value), min: a, max: b });
  const range = el("input", { type: "range", min: a, max: b, step, value: shownValue(value), "aria-label": `${name}, slider` });
  const take = (source) => {
    const number = Number.parseFloat(source.value);
    if (!Number.isFinite(number)) return;
    const held = clamp(number, a, b);
    (source === box ? range : box).value = Number(held.toPrecision(6));
    on(fromShown(item, held));
  };
  range.addEventListener("input", () => take(range));
  box.addEventListener("input", () => take(box));
  box.addEventListener("change", () => {
    box.value = range.value === "" ? box.value : Number(clamp(Number.parseFloat(box.value) || a, a, b).toPrecision(6));
  });
  const title = el("label", { for: id }, el("span", { class: "symbol" }, name), text ? el("span", { class: "hint" }, ` ${text}`) : null);
  const numbers = el("span", { class: "entry" }, box, el("span", { class: "unit" }, unitText(item)));
  if (reset) numbers.append(el("button", { type: "button", class: "quiet", title: `Back to ${words(toShown(item, reset()))}`,
    "aria-label": `Reset ${name}`, on: { click: () => { set(reset()); on(reset()); } } }, "\u21ba"));
  const root = el("div", { class: "field" }, title, numbers, range);
  function set(next) {
    const text = shownValue(next);
    if (document.activeElement !== box) box.value = text;
    range.value = text;
  }
  return { root, set };
}

/** A button that acts while it is held: by pointer, by Space or Enter. */
function holdButton(text, press, release, settings = {}) {
  let down = false;
  const start = (event) => {
    if (event.type === "keydown" && ![" ", "Enter"].includes(event.key)) return;
    event.preventDefault();
    if (!down) press();
    down = true;
    button.classList.add("down");
  };
  const end = () => {
    if (down) release();
    down = false;
    button.classList.remove("down");
  };
  const button = el("button", { type: "button", class: "hold", ...settings, on: {
    pointerdown: (event) => { button.focus(); button.setPointerCapture(event.pointerId); start(event); },
    pointerup: end, pointercancel: end, lostpointercapture: end, keydown: start, keyup: end, blur: end, contextmenu: (event) => event.preventDefault(),
  } }, text);
  return button;
}

function toggle(name, text, value, on) {
  const box = el("input", { type: "checkbox", on: { change: () => on(box.checked) } });
  box.checked = Boolean(value);
  return { root: el("label", { class: "toggle" }, box, el("span", {}, text || name)), set: (next) => { box.checked = Boolean(next); } };
}

function choice(name, pairs, value, on) {
  const list = el("select", { "aria-label": name, on: { change: () => on(list.value) } },
    ...pairs.map(([each, text]) => el("option", { value: each }, text)));
  list.value = value;
  return list;
}

/** The range of a slider: what the plant declares, else about the value. */
function rangeOf(item, value, others = [], angle = item.unit === "rad") {
  const [low, high] = item.range || [null, null];
  const scale = item.scale || 1;
  const size = niceAbove((Math.max(Math.abs(value), ...others.map(Math.abs), 0) || 0.5 * scale) / scale) * scale;
  const turn = angle ? Math.PI : 0;
  // About zero nothing tells how far people want to go.
  const top = Math.max((others.length && value === 0 ? 5 : 2) * size, turn);
  return [low ?? (turn || others.length || value <= 0 ? -top : 0), high ?? top];
}
