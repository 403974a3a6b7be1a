// The plant in motion, one cell a controller, and the hands on it: drag a body, drag the set point.

class Stage {
  constructor(canvas, app) {
    this.app = app;
    this.sheet = new Sheet(canvas);
    this.held = null; // what the pointer holds
    this.spans = new Map(); // grown ranges of needles and tanks
    this.camera = new Map();
    canvas.addEventListener("pointerdown", (event) => this._down(event));
    canvas.addEventListener("pointermove", (event) => this._move(event));
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(kind, () => this.letGo());
    canvas.addEventListener("keydown", (event) => this._key(event));
  }

  get kind() {
    const picture = this.app.payload.picture;
    return picture && PICTURES[picture.kind] ? PICTURES[picture.kind] : NEEDLES;
  }

  forget() {
    this.spans.clear();
    this.camera.clear();
  }

  /** The places of the cells, one a loop. */
  cells() {
    const count = this.app.loops.length;
    const { w, h } = this.sheet;
    let columns = count > 2 ? this.columns(w) : 1;
    if (count === 2) columns = w > h ? 2 : 1;
    const rows = Math.ceil(count / columns);
    return this.app.loops.map((_, k) => ({
      x: ((k % columns) * w) / columns, y: (Math.floor(k / columns) * h) / rows, w: w / columns, h: h / rows,
    }));
  }

  /** So many stand beside each other where there are more than two, in rows of about equal length. */
  columns(width) {
    const count = this.app.loops.length;
    const most = clamp(Math.floor(width / (width > 600 ? 195 : 140)), 1, count);
    return Math.ceil(count / Math.ceil(count / most));
  }

  fit() {
    const { canvas } = this.sheet;
    canvas.style.setProperty("--rows", Math.ceil(this.app.loops.length / this.columns(canvas.clientWidth)));
    this.sheet.fit();
  }

  /** What a picture may ask of loop number `k`. */
  view(k) {
    const { app } = this;
    const loop = app.loops[k];
    const parts = app.payload.picture ? app.payload.picture.parts : {};
    const name = (role, place = null) => (place === null ? parts[role] : (parts[role] || [])[place]);
    const get = (label) => {
      const value = loop.get(label);
      return Number.isFinite(value) ? value : 0;
    };
    const parameter = (role) => loop.facts.parameters.find((each) => each.name === parts[role]);
    return {
      parts, name, get,
      states: loop.facts.states,
      walls: (label) => (loop.facts.stops || []).filter((each) => each.position === label).flatMap((each) => each.range).filter((each) => each !== null),
      muscles: (loop.facts.muscles || []).map((label) => clamp(get(label), 0, 1)),
      value: (role, place = null) => (name(role, place) === undefined ? null : get(name(role, place))),
      size: (role) => (typeof parts[role] === "number" ? parts[role] : parts[role] === undefined ? null : app.parameter(parts[role], k)),
      usual: (role) => (typeof parts[role] === "number" ? parts[role] : parameter(role)?.value),
      shown: (role) => {
        const item = parameter(role) || app.signal(parts[role], k);
        if (!item) return words(parts[role]);
        const value = parameter(role) ? app.parameter(parts[role], k) : get(parts[role]);
        return withUnit(parameter(role) ? words(toShown(item, value)) : value.toFixed(1).replace("-", MINUS), item);
      },
      share: (role) => (parts[role] === undefined ? null : get(parts[role]) / this.reach(k, [parts[role]])),
      reach: (role, given) => given || this.reach(k, [parts[role]].flat()),
      span: (label) => this.span(k, label),
      target: (role) => app.targetOf(parts[role]),
      camera: (role, width) => this.follow(k, parts[role], width),
      follow: (x, y, box) => this.world(k, parts[x], parts[y], box),
    };
  }

  /** How far some states have been from zero, as a round number that only grows. */
  reach(k, names) {
    const key = names.join();
    const largest = Math.max(...names.map((name) => {
      const row = this.app.signal(name, k);
      const target = this.app.targetOf(name);
      const start = row && row.value !== undefined ? row.value : 0;
      const ahead = Math.max(...(this.app.foreseen.get(name) ?? [0]).map(Math.abs));
      return Math.max(Math.abs(this.app.loops[k].get(name)) || 0, Math.abs(target ?? 0), Math.abs(start) * 1.4, ahead);
    }));
    const grown = Math.max(this.spans.get(key) || 0, niceAbove(largest > 1e-12 ? Math.min(largest, 1e9) * 1.05 : 1));
    this.spans.set(key, grown);
    return grown;
  }

  span(k, name) {
    const row = this.app.signal(name, k);
    if (row && row.range && row.range[0] !== null && row.range[1] !== null) return row.range;
    const reach = this.reach(k, [name]);
    return [-reach, reach];
  }

  /** A camera along one axis: moves only when the body is about to leave. */
  follow(k, name, width) {
    const value = this.app.loops[k].get(name);
    const margin = width * 0.3;
    const key = `${k} ${name}`;
    const centre = this.camera.get(key) ?? 0;
    const moved = Number.isFinite(value) ? clamp(centre, value - margin, value + margin) : centre;
    this.camera.set(key, moved);
    return moved;
  }

  /** A map of the plane with a camera. */
  world(k, x, y, box) {
    const scale = Math.min(box.w, box.h) / 10;
    const cx = this.follow(k, x, box.w / scale);
    const cy = this.follow(k, y, box.h / scale);
    const middle = [box.x + box.w / 2, box.y + box.h / 2];
    const to = (a, b) => [middle[0] + (a - cx) * scale, middle[1] - (b - cy) * scale];
    const grid = (c, look) => {
      for (const tick of ticksBetween(cx - box.w / 2 / scale, cx + box.w / 2 / scale, 8)) {
        const [at] = to(tick, 0);
        line(c, [at, box.y], [at, box.y + box.h], look.rule, 1);
        label(c, words(tick), [at + 3, box.y + box.h - 9], look.muted, { size: 11 });
      }
      for (const tick of ticksBetween(cy - box.h / 2 / scale, cy + box.h / 2 / scale, 8)) {
        const [, at] = to(0, tick);
        line(c, [box.x, at], [box.x + box.w, at], look.rule, 1);
        label(c, words(tick), [box.x + 3, at - 8], look.muted, { size: 11 });
      }
    };
    return { to, grid, from: (point) => [cx + (point[0] - middle[0]) / scale, cy - (point[1] - middle[1]) / scale] };
  }

  draw() {
    const { app, sheet } = this;
    const { look } = app;
    const c = sheet.c;
    sheet.clear();
    this.handles = [];
    this.cells().forEach((cell, k) => {
      c.save();
      c.beginPath();
      c.rect(cell.x, cell.y, cell.w, cell.h);
      c.clip();
      const view = this.view(k);
      const head = app.loops.length > 1 ? 24 : 0;
      const box = { x: cell.x + 6, y: cell.y + 6 + head, w: cell.w - 12, h: cell.h - 12 - head };
      const ended = app.loops[k].outcome !== "running";
      c.globalAlpha = ended ? 0.35 : 1;
      this.kind.draw(c, box, view, look, look.colour(k), this._trail(k));
      c.globalAlpha = 1;
      if (app.loops.length > 1) this._title(c, cell, k, look);
      this._ghosts(c, box, view, look, k);
      if (this.held && this.held.push) this._spring(c, box, view, look);
      c.restore();
    });
  }

  _title(c, cell, k, look) {
    block(c, cell.x + 12, cell.y + 13, 11, 11, look.colour(k), null, 3);
    label(c, fitted(c, this.app.payload.loops[k].title, cell.w - 44), [cell.x + 29, cell.y + 19], look.ink, { weight: "600" });
  }

  /** The set points, each at the state that it is of. */
  _ghosts(c, box, view, look, k) {
    for (const target of this.app.targets) {
      if (!target.state) continue;
      const spot = this._roleOf(view, box, target.state);
      if (!spot) continue;
      const at = this.kind.ghost(c, box, view, this.app.input(target.name), look, spot.role, spot.place ?? null);
      if (at) this.handles.push({ at, target, grip: spot, k, box });
    }
  }

  /** The grip of a state. */
  _roleOf(view, box, state) {
    return this.kind.grips(box, view).find((grip) => (grip.direct ? grip.role : view.name(grip.role, grip.place ?? null)) === state);
  }

  _spring(c, box, view, look) {
    const { grip, point } = this.held;
    const same = this.kind.grips(box, view).find((each) => each.role === grip.role && each.place === grip.place);
    if (!same || this.app.loops.length > 1) return;
    coil(c, same.at, point, look.muted, 5, 7);
    disc(c, point, 6, look.accent);
  }

  _trail(k) {
    const picture = this.app.payload.picture;
    if (!picture || !["vehicle", "aircraft"].includes(picture.kind)) return [];
    const { record } = this.app;
    const columns = record.columns[k];
    const [x, y] = [columns[picture.parts.x], columns[picture.parts.y]];
    const points = [];
    const end = record.from(this.app.clockTime + 1e-9);
    for (let j = record.from(this.app.clockTime - 20 * this.app.pace); j < end; j += 6) if (Number.isFinite(x[j])) points.push([x[j], y[j]]);
    return points;
  }

  // ------------------------------------------------------------------------------------------------------- pointer

  _down(event) {
    if (this.app.replay) return;
    const point = this.sheet.at(event);
    this.draw();
    const near = (at) => Math.hypot(at[0] - point[0], at[1] - point[1]);
    let handle = this.handles.filter((each) => near(each.at) < 24).sort((a, b) => near(a.at) - near(b.at))[0];
    const cells = this.cells();
    const k = cells.findIndex((cell) => point[0] >= cell.x && point[0] < cell.x + cell.w && point[1] >= cell.y && point[1] < cell.y + cell.h);
    if (k < 0) return;
    const head = this.app.loops.length > 1 ? 24 : 0;
    const cell = cells[k];
    const box = { x: cell.x + 6, y: cell.y + 6 + head, w: cell.w - 12, h: cell.h - 12 - head };
    const view = this.view(k);
    const body = this._bodyAt(point, box, view);
    // Where mark and body lie side by side, the nearer one is meant.
    if (handle && body && body.far < near(handle.at)) handle = null;
    if (handle) this.held = { targets: this._withPair(handle, view), k: handle.k, box: handle.box };
    else if (body) this.held = { push: body.push, grip: body.grip, k, box, point };
    else {
      const first = this.handles.find((each) => each.k === k);
      if (!first) return;
      this.held = { targets: this._withPair(first, view), k, box };
    }
    event.preventDefault();
    this.sheet.canvas.setPointerCapture(event.pointerId);
    this._to(point);
  }

  /** The set points that one handle moves: both of a place in the plane. */
  _withPair(handle, view) {
    const pair = handle.grip.pair && view.name(handle.grip.pair);
    return this.handles.filter((each) => each === handle || (pair && each.k === handle.k && each.target.state === pair));
  }

  /** The body under the pointer that can be pushed. */
  _bodyAt(point, box, view) {
    const distance = (grip) => (grip.along ? toSegment(point, ...grip.along) * 1.6 : Math.hypot(grip.at[0] - point[0], grip.at[1] - point[1]));
    const found = this.kind.grips(box, view)
      .map((grip) => ({ grip, far: distance(grip), state: grip.direct ? grip.role : view.name(grip.role, grip.place ?? null) }))
      .filter((each) => each.far < each.grip.radius)
      .map((each) => ({ ...each, push: this.app.pushOf(each.state) }))
      .filter((each) => each.push)
      .sort((a, b) => a.far - b.far);
    return found[0] || null;
  }

  _move(event) {
    if (this.app.replay) return;
    if (!this.held) {
      const point = this.sheet.at(event);
      const over = (this.handles || []).some((each) => Math.hypot(each.at[0] - point[0], each.at[1] - point[1]) < 24);
      this.sheet.canvas.classList.toggle("grab", over);
      return;
    }
    this._to(this.sheet.at(event));
  }

  _to(point) {
    const { held, app } = this;
    const view = this.view(held.k);
    if (held.targets) {
      for (const { target } of held.targets) {
        const grip = this._roleOf(view, held.box, target.state);
        app.setInput(target.name, grip.to(point, app.input(target.name)));
      }
    } else {
      held.point = point;
      this.pull();
    }
    app.changed();
  }

  /** The spring between pointer and body, renewed before every frame. */
  pull() {
    const { held, app } = this;
    if (!held || !held.push) return;
    const view = this.view(held.k);
    const grip = this.kind.grips(held.box, view).find((each) => each.role === held.grip.role && each.place === held.grip.place);
    if (!grip) return;
    const present = held.push.at(held.k);
    // A spring with a damper: a hand that lags must not feed the swing.
    const drag = held.push.damping * app.loops[held.k].get(held.push.state);
    app.push(held.push, held.push.stiffness * (grip.to(held.point, present) - present) - drag);
  }

  letGo() {
    if (this.held && this.held.push) this.app.push(this.held.push, 0);
    this.held = null;
    this.app.changed();
  }

  _key(event) {
    const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
    if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
    const vertical = ["ArrowUp", "ArrowDown"].includes(event.key);
    const targets = this.app.targets;
    const target = targets[targets.length > 1 && vertical ? 1 : 0];
    if (!target) return;
    event.preventDefault();
    this.app.setInput(target.name, this.app.input(target.name) + step * target.step * (event.shiftKey ? 5 : 1));
    this.app.changed();
  }
}

function toSegment(point, from, to) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const share = clamp(((point[0] - from[0]) * dx + (point[1] - from[1]) * dy) / (dx * dx + dy * dy || 1), 0.25, 1);
  return Math.hypot(point[0] - from[0] - share * dx, point[1] - from[1] - share * dy);
}

/** A text cut so that it fits. */
function fitted(c, text, width) {
  c.font = "600 12px system-ui, sans-serif";
  if (c.measureText(text).width <= width) return text;
  let short = text;
  while (short.length > 1 && c.measureText(`${short}\u2026`).width > width) short = short.slice(0, -1);
  return `${short}\u2026`;
}
