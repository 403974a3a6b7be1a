// `ulnaClock`: loops side by side in one time, as fast as the wall clock says, with a past to go back to.

const LONGEST_FRAME = 100;  // ms: what a hidden tab missed beyond this is not caught up
const POINTS = 120;  // recorded points in a second of the wall clock
const PAST = 30;  // states kept of a second of the wall clock
const SPEEDS = [1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001];

function ulnaClock(loops, { speed = 1, keep = 60, budget = 8, now = () => performance.now() } = {}) {
  let seen = null, target = 0, playing = false, present = speed;
  let spent = 0, passed = 0, kept = [], place = -1;

  const furthest = () => Math.max(...loops.map((loop) => loop.time));
  // A recorded run lies there whole: it can be sought anywhere.
  const recording = () => loops.every((loop) => loop.replay);
  const running = () => loops.some((loop) => loop.outcome === "running");

  function remember(time) {
    kept.length = place + 1;
    kept.push({ time, rows: loops.map((loop) => loop.snapshot()) });
    if (kept.length > keep * PAST) kept.splice(0, kept.length - keep * PAST);
    place = kept.length - 1;
  }

  // All loops to a time, each in whole samples.
  function advance(time) {
    let samples = 0;
    for (const loop of loops) {
      if (loop.replay) {
        const before = loop.samples;
        loop.seek(time);
        samples += loop.samples - before;
        continue;
      }
      const period = loop.facts.period;
      const count = Math.min(1e6, Math.floor((time - loop.time) / period + 1e-6));
      if (count > 0) {
        loop.step(count);
        samples += count;
      }
    }
    return samples;
  }

  function recorded(time) {
    if (!kept.length || time >= kept[place].time + present / PAST - 1e-12) remember(time);
    if (clock.onSample) loops.forEach((loop, k) => clock.onSample(loop, k));
  }

  const clock = {
    onSample: null,
    get loops() { return loops; },
    get playing() { return playing; },
    get time() { return target; },
    get speed() { return present; },
    set speed(value) { if (value > 0 && Number.isFinite(value)) present = value; },
    // s of the wall clock for a second of the loops at speed 1.
    get ratio() { return passed > 0 ? spent / (1000 * passed) : 0; },
    get possible() {
      const most = clock.ratio > 0 ? 0.7 / clock.ratio : Infinity;
      return speed * (SPEEDS.find((each) => each * speed <= most) ?? SPEEDS[SPEEDS.length - 1]);
    },
    get oldest() { return recording() ? loops[0].beginsAt : kept.length ? kept[0].time : target; },

    frame(wall) {
      const elapsed = seen === null ? 0 : Math.min(wall - seen, LONGEST_FRAME);
      seen = wall;
      if (!playing || !(elapsed > 0)) return 0;
      const goal = target + (elapsed / 1000) * present, began = now(), from = target;
      if (!kept.length) remember(target);
      let samples = 0, late = false;
      while (target < goal && !late && running()) {
        target = Math.min(goal, target + present / POINTS);
        const taken = advance(target);
        samples += taken;
        if (taken) recorded(target);
        late = now() - began > budget;
      }
      // Only what the work took counts; it is forgotten slowly, so that a hiccup does not decide.
      spent = 0.98 * spent + (now() - began);
      passed = 0.98 * passed + (target - from);
      return samples;
    },

    play() { playing = true; seen = null; },
    pause() { playing = false; },

    single() {
      playing = false;
      if (!kept.length) remember(target);
      let samples = 0;
      if (recording()) {
        loops.forEach((loop) => loop.step());
        [target, samples] = [furthest(), 1];
      } else {
        target = Math.max(target, furthest()) + Math.min(...loops.map((loop) => loop.facts.period));
        samples = advance(target);
      }
      if (samples) {
        remember(target);
        if (clock.onSample) loops.forEach((loop, k) => clock.onSample(loop, k));
      }
      return samples;
    },

    // To the state that is kept from nearest to a time.
    seek(time) {
      if (recording()) {
        loops.forEach((loop) => loop.seek(time));
        clock.forget();
        target = Math.max(clock.oldest, Math.min(time, ...loops.map((loop) => loop.duration)));
        return target;
      }
      if (!kept.length) return target;
      let best = 0;
      kept.forEach((each, k) => { if (Math.abs(each.time - time) < Math.abs(kept[best].time - time)) best = k; });
      place = best;
      loops.forEach((loop, k) => loop.restore(kept[best].rows[k]));
      target = kept[best].time;
      return target;
    },

    rewind(seconds) { return clock.seek(target - seconds); },

    // After the loops were started again.
    forget() {
      kept = [];
      place = -1;
      target = furthest();
      seen = null;
    },
  };
  return clock;
}
