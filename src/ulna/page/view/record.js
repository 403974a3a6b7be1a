// What the curves, the table and the files show: the run of every loop at about 120 points a second.

class Record {
  constructor(loops, signals, seconds) {
    this.signals = signals; // [{name, unit, scale, ...}] by loop
    this.capacity = Math.ceil(seconds * 130) * 2;
    this.times = new Float64Array(this.capacity);
    this.columns = loops.map((_, k) => Object.fromEntries(signals[k].map((s) => [s.name, new Float64Array(this.capacity)])));
    this.length = 0;
    this.dropped = false; // whether the beginning of the run has been let go
  }

  get last() {
    return this.length ? this.times[this.length - 1] : -Infinity;
  }

  /** Note the present values of loop number `k`. */
  note(loop, k) {
    const time = loop.time;
    if (time < this.last - 1e-9) this.cut(time);
    if (!this.length || time > this.last + 1e-9) {
      if (this.length === this.capacity) this._drop();
      this.times[this.length] = time;
      for (const columns of this.columns) for (const name in columns) columns[name][this.length] = NaN;
      this.length += 1;
    }
    const columns = this.columns[k];
    for (const name in columns) columns[name][this.length - 1] = loop.get(name);
  }

  /** Let go what lies after a time. */
  cut(time) {
    while (this.length && this.times[this.length - 1] > time + 1e-9) this.length -= 1;
  }

  clear() {
    this.length = 0;
    this.dropped = false;
  }

  /** Place of the first row at or after a time. */
  from(time) {
    let [low, high] = [0, this.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  _drop() {
    const half = this.capacity / 2;
    const move = (row) => row.copyWithin(0, half);
    move(this.times);
    for (const columns of this.columns) for (const name in columns) move(columns[name]);
    this.length = half;
    this.dropped = true;
  }
}

/** Every quantity of a loop that can be shown, once. */
function signalsOf(facts) {
  const found = [];
  const add = (rows, kind) => {
    for (const row of rows || []) if (!found.some((s) => s.name === row.name)) found.push({ ...row, kind });
  };
  add(facts.states, "state");
  add(facts.outputs, "output");
  add(facts.commands, "command");
  add(facts.references, "reference");
  add(facts.estimates, "estimate");
  add(facts.disturbances, "disturbance");
  add(facts.held, "held");
  add(facts.drawn, "source");
  return found;
}
