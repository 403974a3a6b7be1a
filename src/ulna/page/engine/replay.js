// `ulnaReplay`: a recorded run, read like a loop; it can be stepped and sought, not changed.

function ulnaReplay(data) {
  const columns = data.columns.map(doubles), times = doubles(data.times), last = times.length - 1;
  const m = new Float64Array(columns.length + 1);
  const read = new Map();
  for (const { name, slot } of data.signals) if (!read.has(name)) read.set(name, slot);
  let place = 0;

  function show(k) {
    place = Math.max(0, Math.min(last, k));
    columns.forEach((column, j) => { m[j] = column[place]; });
    m[columns.length] = place;
  }

  const loop = {
    facts: data,
    memory: m,
    replay: true,
    beginsAt: times[0],
    duration: times[last],
    rows: times.length,
    get time() { return times[place]; },
    get samples() { return place; },
    get outcome() { return place === last ? data.outcome : "running"; },
    get outcomeText() { return place === last ? data.outcome_text : "It is running."; },
    get endedAt() { return place === last ? times[last] : null; },
    limited: false,
    start() { show(0); return loop; },
    step(count = 1) { show(place + count); return loop.outcome; },
    seek(time) {
      let low = 0, high = last;
      while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (times[middle] <= time) low = middle;
        else high = middle - 1;
      }
      show(low);
    },
    set() {},
    setParameter() {},
    setOption() {},
    has(name) { return read.has(name); },
    index(name) {
      if (!read.has(name)) throw new RangeError(`this run has no signal "${name}"`);
      return read.get(name);
    },
    input(name) { return loop.get(name); },
    get(name) { return m[loop.index(name)]; },
    snapshot() { return m.slice(); },
    restore(row) { show(row[columns.length]); },
    check() { return null; },
  };
  return loop.start();
}
