// Numbers and elements: what a user wrote is always a text node, never markup.

const MINUS = "\u2212";

/** 9.8\u00b710\u207b\u2075 for 9.80e-5. */
function powered(text) {
  const [mantissa, exponent] = text.split("e");
  const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
  const raised = String(Number(exponent)).replace("-", "\u207b").replace(/\d/g, (digit) => "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[digit]);
  return { "1": `10${raised}`, "-1": `-10${raised}` }[short] ?? `${short}\u00b710${raised}`;
}

/** A number to so many digits, without exponent wherever a person would write none. */
function words(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "\u2013";
  if (!Number.isFinite(value)) return value > 0 ? "\u221e" : MINUS + "\u221e";
  const size = Math.abs(value);
  let text;
  if (size === 0) text = "0";
  else if (size >= 1e7 || size < 1e-5) text = powered(value.toExponential(digits - 1));
  else {
    const places = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
    text = value.toFixed(Math.min(places, 12));
    if (text.includes(".")) text = text.replace(/\.?0+$/, "");
  }
  return text.replace("-", MINUS);
}

/** A number with a fixed count of places: live figures that must not dance. `reach`: how far it goes, which sets them. */
function steady(value, reach = null) {
  if (value === null || !Number.isFinite(value)) return words(value);
  if (Math.abs(value) < 1e-12) return "0";
  const size = Math.max(Math.abs(value), reach ?? 0);
  if (size >= 1e5 || (size < 1e-4 && size > 0)) return words(value, 3);
  const places = size >= 1000 ? 0 : Math.min(12, 3 - Math.floor(Math.log10(size)));
  const text = value.toFixed(places);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", MINUS);
}

/** A unit as people write it: rad/s\u00b2 for rad/s/s. */
function unitText(item) {
  const text = item.unit && item.unit !== "1" ? item.unit : "";
  return text.replace("/s/s", "/s\u00b2").replace("/s^2/s", "/s\u00b3").replaceAll("^2", "\u00b2").replaceAll("^3", "\u00b3").replaceAll("*", "\u00b7");
}

const withUnit = (text, item) => (unitText(item) ? `${text}\u202f${unitText(item)}` : text);
const labelOf = (item) => (unitText(item) ? `${item.name} (${unitText(item)})` : item.name);
const toShown = (item, value) => value / (item.scale || 1);
const fromShown = (item, value) => value * (item.scale || 1);
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** The next number above that reads well: 1, 2, 2.5 or 5 times a power of ten. */
function niceAbove(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 2.5, 5, 10].find((each) => each * power >= value * (1 - 1e-9));
}

/** An element; strings among the children become text. */
function el(tag, settings = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(settings)) {
    if (value === false || value === null || value === undefined) continue;
    if (name === "on") for (const [kind, run] of Object.entries(value)) made.addEventListener(kind, run);
    else if (name === "class") made.className = value;
    else if (name === "value") made.value = value;
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children.filter((each) => each !== null && each !== undefined));
  return made;
}

const byId = (name) => document.getElementById(name);

/** The colours of the present scheme, read from the style sheet. */
function lookOf() {
  const style = getComputedStyle(document.documentElement);
  const read = (name) => style.getPropertyValue(name).trim();
  const look = { colours: [] };
  for (const name of ["ink", "muted", "rule", "surface", "back", "accent", "good", "bad", "bone", "water"]) {
    look[name] = read(`--${name}`);
  }
  for (let k = 0; k < 7; k += 1) look.colours.push(read(`--c${k}`));
  look.colour = (k) => look.colours[k % look.colours.length];
  return look;
}

const DASHES = [[], [7, 3], [2, 3], [7, 3, 2, 3]];
/** What colour says is said again by dashes where colours run out. */
const dashOf = (k) => DASHES[Math.floor(k / 7) % DASHES.length];

/** A canvas as large as its place, in device pixels; its context is in CSS pixels. */
class Sheet {
  constructor(canvas) {
    this.canvas = canvas;
    this.c = canvas.getContext("2d");
    this.fit();
  }

  fit() {
    const box = this.canvas.getBoundingClientRect();
    const ratio = Math.min(window.devicePixelRatio || 1, 3);
    this.w = Math.max(1, box.width);
    this.h = Math.max(1, box.height);
    const [w, h] = [Math.round(this.w * ratio), Math.round(this.h * ratio)];
    if (this.canvas.width !== w || this.canvas.height !== h) {
      this.canvas.width = w;
      this.canvas.height = h;
    }
    this.c.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  clear() {
    this.c.clearRect(0, 0, this.w, this.h);
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }
}
