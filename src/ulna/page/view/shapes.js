// Strokes that several pictures share. Lengths are CSS pixels; angles grow clockwise, as on a canvas.

const HEADINGS = { right: 0, down: Math.PI / 2, left: Math.PI, up: -Math.PI / 2 };
const ZERO = { arm: "right", pendulum: "down", "cart-pole": "up", "two-link-arm": "right" };
const TURNS = { arm: "clockwise", pendulum: "anticlockwise", "cart-pole": "clockwise", "two-link-arm": "anticlockwise" };

/** How an angle of the plant turns on the page: heading of its zero, and +1 for clockwise. */
function turning(kind, parts) {
  return {
    zero: HEADINGS[parts.zero || ZERO[kind] || "right"],
    sign: (parts.turns || TURNS[kind] || "anticlockwise") === "clockwise" ? 1 : -1,
  };
}

/** The angle of the plant that points from a pivot to a place, nearest to the present one. */
function angleTo(turn, pivot, point, present) {
  const raw = (Math.atan2(point[1] - pivot[1], point[0] - pivot[0]) - turn.zero) * turn.sign;
  const whole = 2 * Math.PI;
  return raw + whole * Math.round((present - raw) / whole);
}

const polar = (from, angle, length) => [from[0] + length * Math.cos(angle), from[1] + length * Math.sin(angle)];

function line(c, from, to, colour, width, dash = []) {
  c.beginPath();
  c.moveTo(...from);
  c.lineTo(...to);
  c.strokeStyle = colour;
  c.lineWidth = width;
  c.lineCap = "round";
  c.setLineDash(dash);
  c.stroke();
  c.setLineDash([]);
}

function disc(c, at, radius, fill, edge = null, width = 1.5) {
  c.beginPath();
  c.arc(at[0], at[1], Math.max(0, radius), 0, 2 * Math.PI);
  if (fill) {
    c.fillStyle = fill;
    c.fill();
  }
  if (edge) {
    c.strokeStyle = edge;
    c.lineWidth = width;
    c.stroke();
  }
}

function block(c, x, y, w, h, fill, edge, corner = 4) {
  c.beginPath();
  c.roundRect(x, y, w, h, corner);
  if (fill) {
    c.fillStyle = fill;
    c.fill();
  }
  if (edge) {
    c.strokeStyle = edge;
    c.lineWidth = 1.5;
    c.stroke();
  }
}

/** A limb that tapers from one joint to the next. */
function limb(c, from, to, wide, narrow, fill, edge) {
  const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
  c.beginPath();
  c.arc(from[0], from[1], wide, angle + Math.PI / 2, angle - Math.PI / 2);
  c.arc(to[0], to[1], narrow, angle - Math.PI / 2, angle + Math.PI / 2);
  c.closePath();
  c.fillStyle = fill;
  c.fill();
  if (edge) {
    c.strokeStyle = edge;
    c.lineWidth = 1.5;
    c.stroke();
  }
}

function label(c, text, at, colour, { align = "left", size = 12, weight = "" } = {}) {
  c.font = `${weight} ${size}px system-ui, sans-serif`;
  c.textAlign = align;
  c.textBaseline = "middle";
  c.fillStyle = colour;
  c.fillText(text, at[0], at[1]);
}

/** A spring in so many turns between two places. */
function coil(c, from, to, colour, width = 8, turns = 9) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(dx, dy) || 1;
  const [nx, ny] = [-dy / length, dx / length];
  c.beginPath();
  c.moveTo(...from);
  for (let k = 1; k < 2 * turns; k += 1) {
    const along = 0.1 + (0.8 * k) / (2 * turns);
    const side = (k % 2 ? 1 : -1) * width;
    c.lineTo(from[0] + dx * along + nx * side, from[1] + dy * along + ny * side);
  }
  c.lineTo(...to);
  c.strokeStyle = colour;
  c.lineWidth = 1.5;
  c.lineJoin = "round";
  c.stroke();
}

function arrow(c, from, to, colour, width = 3) {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  if (length < 4) return;
  const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
  line(c, from, polar(to, angle + Math.PI, 7), colour, width);
  c.beginPath();
  c.moveTo(...to);
  c.lineTo(...polar(to, angle + Math.PI - 0.45, 13));
  c.lineTo(...polar(to, angle + Math.PI + 0.45, 13));
  c.closePath();
  c.fillStyle = colour;
  c.fill();
}

/** A hatched support below a line. */
function ground(c, from, to, colour) {
  line(c, from, to, colour, 1.5);
  for (let x = from[0]; x < to[0]; x += 9) line(c, [x + 6, from[1]], [x, from[1] + 6], colour, 1);
}

/** Marks of a scale at round numbers: [value, ...] between low and high. */
function ticksBetween(low, high, count) {
  const step = niceAbove((high - low) / count);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k += 1) found.push(k * step);
  return found;
}
