// The page: loops, clock, views, and what a hand asks of them.

class App {
  constructor(payload, programs) {
    this.payload = payload;
    this.look = lookOf();
    this.foreseen = new Map(); // [low, high] by state
    for (const { facts } of payload.loops) {
      const starts = new Map(facts.initial.map((each) => [each.name, each.value]));
      for (const row of [...facts.states, ...facts.memory]) row.value ??= starts.get(row.name) ?? 0;
    }
    this.replay = Boolean(payload.replay); // a recorded run: it can be sought, not changed
    this.loops = payload.loops.map(({ facts }, k) => (this.replay ? ulnaReplay(facts) : ulnaLoop(programs[k], facts)));
    this.settings = this.loops.map(() => ({ parameters: {}, options: {} }));
    this.initial = {};
    this.inputRows = this._inputs();
    this.inputs = new Map(this.inputRows.map((row) => [row.name, row.value]));
    this.signals = this.loops.map((loop) => signalsOf(loop.facts));
    this.targets = this._targets();
    this.pushes = this._pushes();
    this.disturbances = this.inputRows.filter((row) => row.kind === "disturbance" && !row.push);
    this.load = this._load();
    this.record = new Record(this.loops, this.signals, this.replay ? Math.max(62, this.loops[0].rows / 130) : 62);
    this.pace = Math.max(...this.loops.map((loop) => loop.facts.speed || 1)); // slow processors are shown faster
    this.clock = ulnaClock(this.loops, { speed: this.pace, keep: 60, budget: 8 });
    this.figures = new Figures(byId("figures"), this);
    this.stage = new Stage(byId("stage"), this);
    this.plane = payload.plane ? new Plane(byId("plane"), this) : null;
    this.poles = payload.loops.some((loop) => loop.poles.length) ? new Sheet(byId("poles")) : null;
    this.curves = new Curves(byId("curves"), this);
    this.usualCurves = this._usualCurves();
    this.clock.onSample = (loop, k) => this._note(loop, k ?? this.loops.indexOf(loop));
    this.slowFrames = 0;
    this.dirty = true;
    this.frames = [];
    this._recordAll();
  }

  get clockTime() {
    return Math.max(...this.loops.map((loop) => loop.time));
  }

  /** Whether anything can still move. */
  get running() {
    return this.loops.some((loop) => loop.outcome === "running");
  }

  // --------------------------------------------------------------------------------------------------- quantities

  signal(name, k = 0) {
    return this.signals[k].find((each) => each.name === name) || this.signals.flat().find((each) => each.name === name);
  }

  limits(name) {
    const loop = this.loops.find((each) => each.facts.limits && each.facts.limits[name]);
    if (!loop) return null;
    return loop.facts.limits[name].map((value) => (value === null ? null : toShown(this.signal(name), value)));
  }

  /** References and disturbances of all loops, by name. */
  _inputs() {
    const found = [];
    for (const loop of this.loops) {
      for (const kind of ["reference", "disturbance"]) {
        for (const row of loop.facts[`${kind}s`]) if (!found.some((each) => each.name === row.name)) found.push({ ...row, kind });
      }
    }
    return found;
  }

  _targets() {
    const outputs = this.loops.flatMap((loop) => loop.facts.outputs.concat(loop.facts.states));
    const found = [];
    for (const row of this.inputRows) {
      if (row.kind !== "reference" || /_d\d+$/.test(row.name)) continue;
      const output = row.name.replace(/_ref$/, "");
      const signal = outputs.find((each) => each.name === output);
      const state = this.payload.shows[output] || (signal && this.loops[0].facts.states.some((s) => s.name === output) ? output : null);
      const like = outputs.find((each) => each.name === state) || signal;
      const item = { ...row, unit: row.unit || like?.unit || "", scale: row.unit ? row.scale : like?.scale || 1, range: row.range || like?.range || null };
      const { parts = {} } = this.payload.picture || {};
      const angle = item.unit === "rad" || [parts.angle, parts.heading, ...(parts.angles || [])].includes(state);
      const range = rangeOf(item, item.value, [item.value, like?.value || 0], angle);
      found.push({ name: row.name, output: signal ? output : null, state, row: item, range, step: (range[1] - range[0]) / 100 });
    }
    return found.filter((target) => target.output);
  }

  targetOf(state) {
    const target = this.targets.find((each) => each.state === state);
    return target ? this.input(target.name) : null;
  }

  _pushes() {
    const rows = this.inputRows.filter((row) => row.push);
    return rows.map((row) => {
      const position = Object.keys(this.payload.velocities).find((name) => this.payload.velocities[name] === row.push);
      const shown = position || row.push;
      const [low, high] = rangeOf(this.signal(shown), this.signal(shown).value);
      const size = Math.min((high - low) / 4, 1) || 1;
      const [stiffness, damping] = position ? [64, 12] : [6, 0]; // of a hand, in 1/s and its square
      return { name: row.name, row, state: row.push, position: shown, stiffness, damping, strength: niceAbove(stiffness * size * 0.3), at: (k) => this.loops[k].get(shown) };
    });
  }

  pushOf(state) {
    return this.pushes.find((push) => push.position === state || push.state === state) || null;
  }

  /** Whether what a hand holds moves the set points. */
  get led() {
    const [loop] = this.loops;
    return Boolean(loop.facts.held) && loop.option("source");
  }

  /** A hand holds one of the source's inputs, which then moves the set points. */
  hold(name, value) {
    this.loops.forEach((loop, k) => {
      if (!loop.option("source")) this.setOption(k, "source", true);
      loop.set(name, value);
    });
    this.changed();
  }

  input(name) {
    if (this.led && has(this.loops[0].facts, name)) return this.loops[0].input(name);
    return this.replay && this.loops[0].has(name) ? this.loops[0].get(name) : this.inputs.get(name) ?? 0;
  }

  setInput(name, value) {
    const row = this.inputRows.find((each) => each.name === name);
    if (!row || this.replay || !Number.isFinite(value)) return;
    const target = this.targets.find((each) => each.name === name);
    const [low, high] = target ? target.range : row.range || [null, null];
    const held = clamp(value, low ?? -Infinity, high ?? Infinity);
    if (target && this.led) this.letGo();
    this.inputs.set(name, held);
    for (const loop of this.loops) if (has(loop.facts, name)) loop.set(name, held);
    if (target && this.figures && target === this.targets[0]) this.figures.jumped();
    if (this.controls) this.controls.renew();
    this.noteAddress();
    this.changed();
  }

  /** The set points stay where the source left them, without a derivative, and are moved by hand from now on. */
  letGo() {
    for (const row of this.inputRows.filter((each) => each.kind === "reference")) {
      const value = /_d\d+$/.test(row.name) ? 0 : this.loops[0].input(row.name);
      this.inputs.set(row.name, value);
      for (const loop of this.loops) if (has(loop.facts, row.name)) loop.set(row.name, value);
    }
    this.loops.forEach((_, k) => this.setOption(k, "source", false));
    this.say("The set point is moved by hand.");
  }

  push(push, value) {
    for (const loop of this.loops) if (has(loop.facts, push.name)) loop.set(push.name, value);
    this.changed();
  }

  parameter(name, k, owner = "plant") {
    const item = this.loops[k].facts.parameters.find((each) => each.name === name && each.owner === owner);
    return this.settings[k].parameters[`${owner}.${name}`] ?? item?.value ?? 0;
  }

  /** A parameter of the plant goes to every loop, one of a controller to its own. */
  setParameter(k, owner, name, value) {
    if (this.replay) return;
    this.loops.forEach((loop, j) => {
      const item = loop.facts.parameters.find((each) => each.name === name && each.owner === owner);
      if (!item || (owner !== "plant" && j !== k)) return;
      const [low, high] = item.range || [null, null];
      const held = clamp(value, low ?? -Infinity, high ?? Infinity);
      if (held === item.value) delete this.settings[j].parameters[`${owner}.${name}`];
      else this.settings[j].parameters[`${owner}.${name}`] = held;
      loop.setParameter(name, held, owner);
    });
    this.noteAddress();
    this.changed();
  }

  setOption(k, name, value) {
    const item = this.loops[k]?.facts.options.find((each) => each.name === name);
    if (!item) return;
    const held = item.kind === "switch" ? Boolean(value) : Number(value);
    this.settings[k].options[name] = held;
    if (held === item.value) delete this.settings[k].options[name];
    this.loops[k].setOption(name, held);
    this.noteAddress();
    this.changed();
  }

  _load() {
    const name = this.payload.picture?.parts?.load;
    const item = this.loops[0].facts.parameters.find((each) => each.name === name && each.owner === "plant");
    return item && !this.replay ? { name, full: item.value, none: Math.max(0, item.range?.[0] ?? 0) } : null;
  }

  get loadCarried() {
    return this.parameter(this.load.name, 0) > this.load.none;
  }

  toggleLoad() {
    this.setParameter(0, "plant", this.load.name, this.loadCarried ? this.load.none : this.load.full);
    this.controls.renew();
    this.say(this.loadCarried ? "The load is carried." : "The load is dropped.");
  }

  _usualCurves() {
    const outputs = this.targets.map((target) => target.state || target.output);
    const states = this.signals[0].filter((s) => s.kind === "state").map((s) => s.name);
    const commands = [...new Set(this.loops.flatMap((loop) => loop.facts.commands.map((u) => u.name)))];
    if (this.loops[0].facts.held) return [...new Set([...outputs, ...this.loops[0].facts.drawn.map((row) => row.name), ...commands])].slice(0, 6);
    const room = Math.max(1, 4 - Math.min(commands.length, 2));
    return [...new Set([...outputs, ...states])].slice(0, room).concat(commands.slice(0, 2));
  }

  // ---------------------------------------------------------------------------------------------------------- time

  _note(loop, k) {
    if (!this.replay) this.record.note(loop, k);
    this.figures.note(loop, k);
  }

  _recordAll() {
    this.loops.forEach((loop, k) => this._note(loop, k));
  }

  /** All of a recorded run at once: what is drawn of it ends at the present time. */
  _recordWhole() {
    const [loop] = this.loops;
    for (let row = 0; row < loop.rows; row += 1, loop.step()) this.record.note(loop, 0);
    loop.start();
  }

  /** The figures of a recorded run, from its start to the present time. */
  _figuresAgain() {
    const [loop] = this.loops, present = loop.samples;
    this.figures.forget();
    loop.start();
    this.figures.jumped();
    this.figures.note(loop, 0);
    while (loop.samples < present) {
      loop.step();
      this.figures.note(loop, 0);
    }
  }

  /** Once more from the start: the present one, with what the sliders say. */
  restart() {
    const inputs = Object.fromEntries(this.inputs);
    this.loops.forEach((loop, k) => {
      const mine = Object.fromEntries(Object.entries(inputs).filter(([name]) => has(loop.facts, name)));
      loop.start({ initial: this._startOf(loop), inputs: mine, options: this.settings[k].options });
      for (const [key, value] of Object.entries(this.settings[k].parameters)) {
        const [owner, ...name] = key.split(".");
        loop.setParameter(name.join("."), value, owner);
      }
    });
    this._foresee();
    this.clock.forget();
    this.latest = 0;
    this.record.clear();
    if (this.replay) this._recordWhole();
    this.figures.forget();
    this.stage.forget();
    if (this.plane) this.plane.forget();
    this._recordAll();
    this.figures.jumped();
    if (this.controls) this.controls.renew();
    this.noteAddress();
    this._outcomes();
    this.changed();
  }

  /** How far each state will go in the next seconds if nobody touches it: axes that fit from the start. */
  _foresee() {
    this.foreseen.clear();
    const until = performance.now() + 60;
    for (const loop of this.replay ? [] : this.loops) {
      const ahead = loop.copy();
      const count = Math.max(1, Math.round((4 * this.pace) / loop.facts.period / 200));
      for (let k = 0; k < 200 && ahead.outcome === "running" && performance.now() < until; k += 1) {
        for (const { name } of loop.facts.states) {
          const value = ahead.get(name), [low, high] = this.foreseen.get(name) ?? [0, 0];
          if (Math.abs(value) < 1e4) this.foreseen.set(name, [Math.min(low, value), Math.max(high, value)]);
        }
        ahead.step(count);
      }
    }
  }

  /** Where a loop begins: what was asked for, its estimates with it unless they were named. */
  _startOf(loop) {
    const known = (name) => loop.facts.initial.some((each) => each.name === name);
    const found = Object.fromEntries(Object.entries(this.initial).filter(([name]) => known(name)));
    if (!Object.keys(found).length) return {};
    for (const state of loop.facts.states) {
      const hat = `${state.name}_hat`;
      if (known(hat) && !(hat in found)) found[hat] = found[state.name] ?? state.value;
    }
    return found;
  }

  startFrom(state) {
    if (this.replay) return;
    this.initial = { ...this.initial, ...this.payload.region?.rest, ...state };
    this.restart();
    this.say(`Started from ${Object.entries(state).map(([name, value]) => `${name} ${words(value, 3)}`).join(", ")}.`);
  }

  play() {
    this.clock.play();
    this._transport();
    this.changed();
  }

  pause() {
    this.clock.pause();
    this._transport();
    this.changed();
  }

  single() {
    this.clock.single();
    this._recordAll();
    this._transport();
    this._outcomes();
    this.changed();
  }

  rewind(seconds) {
    this.seek(this.clock.time - seconds * this.pace);
  }

  /** To a moment of the last minute. */
  seek(time) {
    this.clock.pause();
    this.clock.seek(time);
    if (this.replay) this._figuresAgain();
    for (const name of this.inputs.keys()) {
      const loop = this.loops.find((each) => has(each.facts, name));
      if (loop) this.inputs.set(name, loop.input(name));
    }
    this.controls.renew();
    this._transport();
    this._outcomes();
    this.changed();
  }

  _transport() {
    const playing = this.clock.playing;
    byId("play").textContent = playing ? "Pause" : "Play";
    document.body.classList.toggle("playing", playing);
  }

  /** Ask for a frame: nothing is computed or painted while nothing moves. */
  changed() {
    this.dirty = true;
    if (!this.waiting) {
      this.waiting = true;
      requestAnimationFrame((now) => this._frame(now));
    }
  }

  _frame(now) {
    this.waiting = false;
    this.stage.pull();
    if (this.clock.playing) this.clock.frame(now);
    this.dirty = false;
    this.count = (this.count || 0) + 1;
    this.stage.draw();
    // Curves and figures are read, not watched: fewer frames are enough for them, and not all in the same frame.
    const turn = this.clock.playing ? this.count : null;
    this.curves.draw(turn);
    if (this.plane && (turn === null || turn % 4 === 2)) this.plane.draw();
    if (turn === null || turn % 8 === 1) {
      this.curves.tell();
      if (this.led && this.controls) this.controls.renew();
      this.figures.draw();
      this._time();
    }
    if (this.count % 10 === 0 || !this.clock.playing) this._outcomes();
    if (this.clock.playing || this.dirty) this.changed();
  }

  /** The time shown, and the slider through the last minute. */
  _time() {
    const time = this.clock.time;
    byId("clock").textContent = `${time.toFixed(Math.max(0, 2 - Math.round(Math.log10(this.pace))))} s`;
    const past = byId("past");
    this.latest = this.replay ? this.loops[0].duration : this.clock.playing ? time : Math.max(this.latest || 0, time);
    past.min = this.clock.oldest;
    past.max = this.latest;
    if (document.activeElement !== past || this.clock.playing) past.value = time;
  }

  /** What has to be said: a loop that has ended, a machine that is too slow. */
  _outcomes() {
    const lines = [];
    this.loops.forEach((loop, k) => {
      if (loop.outcome === "running") return;
      lines.push(`${this.loops.length > 1 ? `${this.payload.loops[k].title}: ` : ""}${loop.outcomeText}`);
    });
    const text = lines.join("\n");
    if (byId("ended-text").textContent !== text) byId("ended-text").textContent = text;
    byId("ended").hidden = !lines.length;
    if (lines.length === this.loops.length && this.clock.playing) this.pause();
    this.slowFrames = this.clock.playing && this.clock.ratio > 1.02 ? this.slowFrames + 1 : 0;
    if (this.slowFrames > 8 && this.clock.possible < this.clock.speed) {
      byId("slow-text").textContent = `This run needs ${words(this.clock.ratio, 2)} times the time that it shows, so the page shows it late.`;
      byId("slow-button").textContent = `Slow motion, ${speedText(this.clock.possible)}`;
      byId("slow").hidden = false;
    }
    if (this.clock.ratio <= 1) byId("slow").hidden = true;
  }

  setSpeed(speed) {
    this.clock.speed = speed;
    if (![...byId("speed").options].some((each) => Number(each.value) === speed)) {
      byId("speed").append(el("option", { value: speed }, speedText(speed)));
    }
    byId("speed").value = speed;
    byId("slow").hidden = true;
    this.noteAddress();
  }

  say(text) {
    byId("said").textContent = text;
  }

  noteAddress() {
    clearTimeout(this.addressDue);
    this.addressDue = setTimeout(() => {
      try {
        history.replaceState(null, "", `#${toAddress(this)}`);
      } catch {
        // Inside another page or a mail there is no address to write.
      }
    }, 250);
  }

  resize() {
    this.stage.fit();
    if (this.plane) {
      this.plane.sheet.fit();
      this.plane.draw(); // a canvas of another size is empty
    }
    if (this.poles) {
      this.poles.fit();
      drawPoles(this.poles, this);
    }
    this.curves.resize();
    this.changed();
  }

  restyle() {
    this.look = lookOf();
    this.resize();
  }
}

const has = (facts, name) => facts.references.some((row) => row.name === name) || facts.disturbances.some((row) => row.name === name);

/** A rate of time as people say it: 1 is as the clock goes, or as the slow plant is usually shown. */
function speedText(speed) {
  return speed >= 1 ? `${words(speed)}\u00d7` : `1/${Math.round(1 / speed)}`;
}
