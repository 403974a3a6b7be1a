// One entry a kind of `[picture]`: `layout` turns values into places, `draw` paints them, `grips` says what can be held.
// A grip: {role, at: [x, y], radius, to(point) -> value of that state}; the first one also shows the set point.

const PICTURES = {
  arm: {
    layout(box, p) {
      const turn = turning("arm", p.parts);
      const pivot = [box.x + box.w * 0.46, box.y + box.h * 0.5];
      const length = Math.min(box.w * 0.46 - 34, box.h * 0.5 - 34);
      const angle = turn.zero + turn.sign * p.value("angle");
      return { turn, pivot, length, angle, hand: polar(pivot, angle, length) };
    },
    draw(c, box, p, look, colour) {
      const { turn, pivot, length, angle, hand } = this.layout(box, p);
      const wide = clamp(length * 0.11, 9, 20);
      arc(c, pivot, length, turn, look);
      for (const wall of p.walls(p.parts.angle)) {
        const at = turn.zero + turn.sign * wall;
        line(c, polar(pivot, at, length + 2), polar(pivot, at, length + 14), look.bad, 3);
      }
      const shoulder = [pivot[0], Math.max(box.y + 8, pivot[1] - length * 0.95)];
      limb(c, shoulder, pivot, wide * 0.95, wide * 1.05, look.surface, look.rule);
      line(c, shoulder, pivot, look.rule, 3);
      if (p.muscles.length) this.muscles(c, shoulder, pivot, polar(pivot, angle, length * 0.24), wide, p.muscles, look);
      limb(c, pivot, hand, wide, wide * 0.62, look.surface, colour);
      const side = 0.32 * wide;
      for (const sign of [-1, 1]) {
        const off = [-Math.sin(angle) * side * sign, Math.cos(angle) * side * sign];
        line(c, [pivot[0] + off[0], pivot[1] + off[1]], polar([hand[0] + off[0] * 0.6, hand[1] + off[1] * 0.6], angle, -8), look.bone, 3.2);
      }
      const load = p.size("load");
      if (load > 0) {
        const usual = p.usual("load") || load;
        const radius = clamp(length * 0.1 * Math.cbrt(load / usual), 4, 34);
        line(c, hand, [hand[0], hand[1] + 9], look.muted, 2);
        disc(c, [hand[0], hand[1] + 9 + radius], radius, look.muted, look.ink, 1);
        const text = p.shown("load"), inside = text.length * 6 < 2 * radius - 4;
        if (inside) label(c, text, [hand[0], hand[1] + 9 + radius], look.back, { align: "center", size: 11, weight: "600" });
        else if (length > 90) label(c, text, [hand[0], hand[1] + 17 + 2 * radius], look.muted, { align: "center", size: 11 });
      }
      disc(c, hand, wide * 0.62, colour);
      gear(c, pivot, wide * 1.15, angle, look, colour);
      if (p.parts.current) meter(c, [box.x + wide * 2, box.y + box.h - 22], wide * 1.6, p, "current", look);
    },
    /** Biceps before and triceps behind the upper arm; they swell with their activation. */
    muscles(c, shoulder, elbow, insertion, wide, [lift, lower], look) {
      const top = [shoulder[0], shoulder[1] + wide * 0.6];
      spindle(c, [top[0] + wide * 0.5, top[1]], insertion, wide * (0.42 + 0.5 * lift), look, lift);
      spindle(c, [top[0] - wide * 0.5, top[1]], [elbow[0] - wide * 0.9, elbow[1]], wide * (0.36 + 0.5 * lower), look, lower);
    },
    ghost(c, box, p, value, look) {
      const { turn, pivot, length } = this.layout(box, p);
      return pointer(c, pivot, turn.zero + turn.sign * value, length + 26, look);
    },
    grips(box, p) {
      const { turn, pivot, hand } = this.layout(box, p);
      return [{ role: "angle", at: hand, radius: 40, along: [pivot, hand], to: (point, near) => angleTo(turn, pivot, point, near) }];
    },
  },

  pendulum: {
    layout(box, p) {
      const turn = turning("pendulum", p.parts);
      const pivot = [box.x + box.w * 0.5, box.y + box.h * 0.5];
      const length = Math.min(box.w, box.h) * 0.36;
      const angle = turn.zero + turn.sign * p.value("angle");
      return { turn, pivot, length, angle, bob: polar(pivot, angle, length) };
    },
    draw(c, box, p, look, colour) {
      const { turn, pivot, length, bob } = this.layout(box, p);
      arc(c, pivot, length, turn, look);
      line(c, pivot, bob, colour, 5);
      disc(c, bob, clamp(length * 0.13, 9, 20), colour, look.ink, 1);
      const wheel = p.value("wheel");
      disc(c, pivot, 9, look.surface, look.ink);
      if (wheel !== null) {
        disc(c, pivot, 17, null, look.muted);
        line(c, pivot, polar(pivot, turn.zero + turn.sign * wheel, 17), look.ink, 2.5);
      }
      disc(c, pivot, 4, look.ink);
    },
    ghost(c, box, p, value, look) {
      const { turn, pivot, length } = this.layout(box, p);
      return pointer(c, pivot, turn.zero + turn.sign * value, length + 30, look);
    },
    grips(box, p) {
      const { turn, pivot, bob } = this.layout(box, p);
      return [{ role: "angle", at: bob, radius: 40, along: [pivot, bob], to: (point, near) => angleTo(turn, pivot, point, near) }];
    },
  },

  "cart-pole": {
    layout(box, p) {
      const turn = turning("cart-pole", p.parts);
      const rod = p.value("rope") ?? p.size("length") ?? 1;
      const hangs = turn.zero > 0;
      const scale = Math.min((box.h * 0.56) / Math.max(rod, 1e-9), box.w / (4.2 * rod));
      const [x, rail] = [p.value("position"), box.y + box.h * (hangs ? 0.26 : 0.72)];
      const centre = p.camera("position", box.w / scale);
      const cart = [box.x + box.w / 2 + (x - centre) * scale, rail];
      const joint = hangs ? cart : [cart[0], cart[1] - 12];
      const angle = turn.zero + turn.sign * p.value("angle");
      return { turn, scale, rail, centre, cart, joint, bob: polar(joint, angle, rod * scale), hangs };
    },
    draw(c, box, p, look, colour) {
      const { scale, rail, centre, cart, joint, bob, hangs } = this.layout(box, p);
      ruler(c, box, rail + (hangs ? -24 : 20), centre, scale, look, hangs);
      block(c, cart[0] - 27, cart[1] - 12, 54, 24, look.surface, colour, 5);
      for (const side of [-15, 15]) disc(c, [cart[0] + side, cart[1] + (hangs ? -16 : 14)], 5, look.surface, look.ink);
      line(c, joint, bob, hangs ? look.muted : colour, hangs ? 2 : 5);
      disc(c, bob, 11, colour, look.ink, 1);
      disc(c, joint, 4, look.ink);
    },
    ghost(c, box, p, value, look, role) {
      const g = this.layout(box, p);
      if (role === "angle") return pointer(c, g.joint, g.turn.zero + g.turn.sign * value, 60, look);
      const x = box.x + box.w / 2 + (value - g.centre) * g.scale;
      return marker(c, [clamp(x, box.x + 6, box.x + box.w - 6), g.rail + (g.hangs ? 26 : -24)], look, g.hangs ? -1 : 1);
    },
    grips(box, p) {
      const g = this.layout(box, p);
      const along = (point) => g.centre + (point[0] - box.x - box.w / 2) / g.scale;
      return [
        { role: "position", at: g.cart, radius: 32, to: along },
        { role: "angle", at: g.bob, radius: 32, to: (point, near) => angleTo(g.turn, g.joint, point, near) },
      ];
    },
  },

  "two-link-arm": {
    layout(box, p) {
      const turn = turning("two-link-arm", p.parts);
      const pivot = [box.x + box.w * 0.5, box.y + box.h * 0.5];
      const length = (Math.min(box.w, box.h) / 2 - 30) / 2;
      const [one, two] = [p.value("angles", 0), p.value("angles", 1) ?? 0];
      const first = turn.zero + turn.sign * one;
      const elbow = polar(pivot, first, length);
      return { turn, pivot, length, first, elbow, hand: polar(elbow, first + turn.sign * two, length) };
    },
    draw(c, box, p, look, colour) {
      const { turn, pivot, length, elbow, hand } = this.layout(box, p);
      arc(c, pivot, 2 * length, turn, look);
      limb(c, pivot, elbow, 12, 9, look.surface, colour);
      limb(c, elbow, hand, 9, 6, look.surface, colour);
      for (const [at, radius] of [[pivot, 7], [elbow, 5]]) disc(c, at, radius, look.ink);
      disc(c, hand, 6, colour);
    },
    ghost(c, box, p, value, look, role, place) {
      const g = this.layout(box, p);
      if (place === 0) return pointer(c, g.pivot, g.turn.zero + g.turn.sign * value, g.length * 0.8, look);
      return pointer(c, g.elbow, g.first + g.turn.sign * value, g.length + 16, look);
    },
    grips(box, p) {
      const g = this.layout(box, p);
      const outer = { zero: g.first, sign: g.turn.sign };
      return [
        { role: "angles", place: 0, at: g.elbow, radius: 26, to: (point, near) => angleTo(g.turn, g.pivot, point, near) },
        { role: "angles", place: 1, at: g.hand, radius: 30, to: (point, near) => angleTo(outer, g.elbow, point, near) },
      ];
    },
  },

  tanks: {
    layout(box, p) {
      const count = p.parts.levels.length;
      const top = p.reach("levels", p.parts.full);
      const gap = 14;
      const w = Math.min(120, (box.w - 40 - gap * (count - 1)) / count);
      const h = Math.min(box.h * 0.68, 260);
      const left = box.x + (box.w - count * w - gap * (count - 1)) / 2;
      const foot = box.y + box.h * 0.5 + h / 2;
      return { count, top, w, h, foot, x: (k) => left + k * (w + gap), y: (v) => foot - (h * clamp(v, 0, top * 1.04)) / top };
    },
    draw(c, box, p, look, colour) {
      const g = this.layout(box, p);
      for (let k = 0; k < g.count; k += 1) {
        const [x, value] = [g.x(k), p.value("levels", k)];
        const y = g.y(value);
        c.fillStyle = look.water;
        c.fillRect(x, y, g.w, g.foot - y);
        line(c, [x, y], [x + g.w, y], colour, 3);
        c.beginPath();
        c.moveTo(x, g.foot - g.h - 8);
        c.lineTo(x, g.foot);
        c.lineTo(x + g.w, g.foot);
        c.lineTo(x + g.w, g.foot - g.h - 8);
        c.strokeStyle = look.ink;
        c.lineWidth = 2;
        c.stroke();
        label(c, p.name("levels", k), [x + g.w / 2, g.foot + 14], look.muted, { align: "center" });
        if (g.w > 46) label(c, steady(value), [x + g.w / 2, g.foot - 12], look.ink, { align: "center", weight: "600" });
      }
      for (const tick of ticksBetween(0, g.top, 4)) label(c, words(tick), [g.x(0) - 8, g.y(tick)], look.muted, { align: "right", size: 11 });
    },
    ghost(c, box, p, value, look, role, place) {
      const g = this.layout(box, p);
      const at = [g.x(place) + g.w + 3, g.y(value)];
      line(c, [g.x(place), at[1]], at, look.ink, 1.5, [4, 4]);
      disc(c, at, 8, look.back, look.ink, 2);
      return at;
    },
    grips(box, p) {
      const g = this.layout(box, p);
      const to = (point) => ((g.foot - point[1]) / g.h) * g.top;
      return p.parts.levels.map((_, k) => ({
        role: "levels", place: k, at: [g.x(k) + g.w / 2, g.y(p.value("levels", k))], radius: g.w / 2, to,
      }));
    },
  },

  "levitated-ball": {
    layout(box, p) {
      const far = p.reach("position", p.parts.far);
      const top = box.y + box.h * 0.28;
      const room = box.h * 0.52;
      return { far, top, room, x: box.x + box.w / 2, y: (v) => top + (room * clamp(v, -0.05 * far, 1.15 * far)) / far };
    },
    draw(c, box, p, look, colour) {
      const g = this.layout(box, p);
      const [x, top] = [g.x, g.top];
      block(c, x - 34, box.y + box.h * 0.08, 68, top - box.y - box.h * 0.08, look.surface, look.ink, 3);
      const share = clamp(Math.abs(p.share("current") ?? 0.5), 0, 1);
      for (let k = 0; k < 6; k += 1) {
        const y = box.y + box.h * 0.1 + (k * (top - box.y - box.h * 0.12)) / 6;
        c.globalAlpha = 0.25 + 0.75 * share;
        block(c, x - 43, y, 86, 5, colour, null, 2.5);
      }
      c.globalAlpha = 1;
      for (const tick of ticksBetween(0, g.far, 4)) {
        line(c, [x + 66, g.y(tick)], [x + 72, g.y(tick)], look.muted, 1);
        label(c, words(tick), [x + 76, g.y(tick)], look.muted, { size: 11 });
      }
      const y = g.y(p.value("position"));
      line(c, [x, top], [x, y], look.rule, 1, [2, 4]);
      disc(c, [x, y + 17], 17, colour, look.ink, 1);
      disc(c, [x - 5, y + 11], 4, look.back);
    },
    ghost(c, box, p, value, look) {
      const g = this.layout(box, p);
      line(c, [g.x - 52, g.y(value)], [g.x - 24, g.y(value)], look.ink, 1.5, [4, 4]);
      return marker(c, [g.x - 56, g.y(value)], look, 0);
    },
    grips(box, p) {
      const g = this.layout(box, p);
      const y = g.y(p.value("position"));
      return [{ role: "position", at: [g.x, y + 17], radius: 34, to: (point) => ((point[1] - g.top) / g.room) * g.far }];
    },
  },

  masses: {
    layout(box, p) {
      const count = p.parts.positions.length;
      const reach = p.reach("positions", p.parts.reach);
      const wall = box.x + 22;
      const pitch = (box.w - 60) / count;
      const scale = (pitch * 0.32) / reach;
      const foot = box.y + box.h * 0.58;
      return { count, wall, scale, foot, home: (k) => wall + pitch * (k + 0.66), x: (k, v) => wall + pitch * (k + 0.66) + v * scale };
    },
    draw(c, box, p, look, colour) {
      const g = this.layout(box, p);
      ground(c, [box.x + 12, g.foot + 26], [box.x + box.w - 12, g.foot + 26], look.muted);
      line(c, [g.wall, g.foot - 44], [g.wall, g.foot + 26], look.ink, 3);
      let from = g.wall;
      for (let k = 0; k < g.count; k += 1) {
        const x = g.x(k, p.value("positions", k));
        coil(c, [from, g.foot], [x - 24, g.foot], look.muted);
        line(c, [g.home(k), g.foot + 26], [g.home(k), g.foot + 34], look.muted, 1.5);
        block(c, x - 24, g.foot - 26, 48, 52, look.surface, colour, 5);
        label(c, p.name("positions", k), [x, g.foot], look.ink, { align: "center" });
        from = x + 24;
      }
    },
    ghost(c, box, p, value, look, role, place) {
      const g = this.layout(box, p);
      return marker(c, [g.x(place, value), g.foot - 40], look, 1);
    },
    grips(box, p) {
      const g = this.layout(box, p);
      return p.parts.positions.map((_, k) => ({
        role: "positions", place: k, at: [g.x(k, p.value("positions", k)), g.foot], radius: 34, to: (point) => (point[0] - g.home(k)) / g.scale,
      }));
    },
  },

  rotor: {
    layout(box, p) {
      const at = [box.x + box.w / 2, box.y + box.h / 2];
      return { at, radius: Math.min(box.w, box.h) * 0.32, angle: -(p.value("angle") ?? 0), turn: { zero: 0, sign: -1 } };
    },
    draw(c, box, p, look, colour) {
      const { at, radius, angle } = this.layout(box, p);
      disc(c, at, radius * 1.2, look.surface, look.rule, 2);
      for (let k = 0; k < 12; k += 1) {
        const turn = (k * Math.PI) / 6;
        line(c, polar(at, turn, radius * 1.1), polar(at, turn, radius * 1.2), look.muted, 1.5);
      }
      disc(c, at, radius, look.back, colour, 3);
      for (let k = 0; k < 3; k += 1) line(c, at, polar(at, angle + (k * 2 * Math.PI) / 3, radius - 3), k ? look.rule : colour, k ? 4 : 6);
      disc(c, at, 7, look.ink);
    },
    ghost(c, box, p, value, look) {
      const { at, radius } = this.layout(box, p);
      return pointer(c, at, -value, radius * 1.2 + 14, look);
    },
    grips(box, p) {
      const { at, radius, angle, turn } = this.layout(box, p);
      const mark = polar(at, angle, radius * 0.8);
      return p.parts.angle ? [{ role: "angle", at: mark, radius: 36, to: (point, near) => angleTo(turn, at, point, near) }] : [];
    },
  },

  "ball-and-beam": {
    layout(box, p) {
      const reach = p.reach("position", p.parts.reach);
      const pivot = [box.x + box.w / 2, box.y + box.h * 0.56];
      const half = box.w * 0.42;
      const angle = -p.value("angle");
      return { reach, pivot, half, angle, ball: polar(pivot, angle, (p.value("position") * half) / reach) };
    },
    draw(c, box, p, look, colour) {
      const { pivot, half, angle, ball } = this.layout(box, p);
      line(c, polar(pivot, angle, -half), polar(pivot, angle, half), look.ink, 5);
      disc(c, [ball[0] + 15 * Math.sin(angle), ball[1] - 15 * Math.cos(angle)], 13, colour, look.ink, 1);
      c.beginPath();
      c.moveTo(...pivot);
      c.lineTo(pivot[0] - 18, pivot[1] + 40);
      c.lineTo(pivot[0] + 18, pivot[1] + 40);
      c.closePath();
      c.fillStyle = look.surface;
      c.fill();
      c.strokeStyle = look.muted;
      c.stroke();
    },
    ghost(c, box, p, value, look, role) {
      const g = this.layout(box, p);
      if (role === "angle") return pointer(c, g.pivot, -value, g.half, look);
      const at = polar(g.pivot, g.angle, (value * g.half) / g.reach);
      return marker(c, [at[0], at[1] - 38], look, 1);
    },
    grips(box, p) {
      const g = this.layout(box, p);
      const to = (point) => (((point[0] - g.pivot[0]) * Math.cos(g.angle) + (point[1] - g.pivot[1]) * Math.sin(g.angle)) / g.half) * g.reach;
      return [{ role: "position", at: g.ball, radius: 34, to }];
    },
  },

  vehicle: {
    layout(box, p) {
      const view = p.follow("x", "y", box);
      const at = view.to(p.value("x"), p.value("y"));
      return { view, at, heading: -p.value("heading") };
    },
    draw(c, box, p, look, colour, trail) {
      const { view, at, heading } = this.layout(box, p);
      view.grid(c, look);
      path(c, trail.map(([x, y]) => view.to(x, y)), colour);
      const length = 34;
      const trailer = p.value("trailer");
      if (trailer !== null) {
        const back = polar(at, -trailer, -length * 1.25);
        line(c, at, back, look.muted, 2);
        wagon(c, back, -trailer, length * 0.7, 18, look.surface, colour);
      }
      const middle = polar(at, heading, length * 0.4);
      wagon(c, middle, heading, length, 18, look.surface, colour);
      const front = polar(at, heading, length * 0.8);
      const steering = heading - (p.value("steering") ?? 0);
      line(c, polar(front, steering, -6), polar(front, steering, 6), look.ink, 4);
    },
    ghost(c, box, p, value, look, role) {
      const { view } = this.layout(box, p);
      const [x, y] = role === "x" ? [value, p.target("y") ?? p.value("y")] : [p.target("x") ?? p.value("x"), value];
      const at = view.to(x, y);
      disc(c, at, 9, null, look.ink, 2);
      line(c, [at[0] - 13, at[1]], [at[0] + 13, at[1]], look.ink, 1);
      line(c, [at[0], at[1] - 13], [at[0], at[1] + 13], look.ink, 1);
      return at;
    },
    grips(box, p) {
      const { view, at } = this.layout(box, p);
      return [
        { role: "x", at, radius: 30, to: (point) => view.from(point)[0], pair: "y" },
        { role: "y", at, radius: 30, to: (point) => view.from(point)[1], pair: "x" },
      ];
    },
  },

  aircraft: {
    layout(box, p) {
      const view = p.follow("x", "y", box);
      return { view, at: view.to(p.value("x"), p.value("y")), angle: -p.value("angle") };
    },
    draw(c, box, p, look, colour, trail) {
      const { view, at, angle } = this.layout(box, p);
      view.grid(c, look);
      path(c, trail.map(([x, y]) => view.to(x, y)), colour);
      line(c, polar(at, angle, -34), polar(at, angle, 34), colour, 6);
      for (const side of [-34, 34]) {
        const hub = polar(polar(at, angle, side), angle - Math.PI / 2, 9);
        line(c, polar(at, angle, side), hub, look.ink, 3);
        line(c, polar(hub, angle, -14), polar(hub, angle, 14), look.muted, 2.5);
      }
      disc(c, at, 8, look.ink);
    },
    ghost(c, box, p, value, look, role) {
      return PICTURES.vehicle.ghost.call(this, c, box, p, value, look, role);
    },
    grips(box, p) {
      return PICTURES.vehicle.grips.call(this, box, p);
    },
  },
};

/** The states themselves as needles over scales: any plant can be shown so. */
const NEEDLES = {
  most: 12,
  layout(box, p) {
    const names = p.states.slice(0, this.most);
    const pitch = Math.min(56, (box.h - 16) / names.length);
    const top = box.y + (box.h - pitch * names.length) / 2;
    const widest = (texts, least) => Math.max(least, ...texts.map((text) => text.length * 7.2));
    const left = box.x + 16 + Math.min(widest(names.map((state) => state.name), 20), box.w * 0.28);
    const right = box.x + box.w - 18 - widest(names.map((state) => unitText(state)), 0) - 50;
    return {
      names, pitch, left, right,
      y: (k) => top + pitch * (k + 0.5),
      x: (k, v) => {
        const [low, high] = p.span(names[k].name);
        return left + (right - left) * clamp((v - low) / (high - low), -0.03, 1.03);
      },
    };
  },
  draw(c, box, p, look, colour) {
    const g = this.layout(box, p);
    g.names.forEach((state, k) => {
      const [y, value] = [g.y(k), p.get(state.name)];
      line(c, [g.left, y], [g.right, y], look.rule, 6);
      const [low, high] = p.span(state.name);
      if (low < 0 && high > 0) line(c, [g.x(k, 0), y - 7], [g.x(k, 0), y + 7], look.muted, 1);
      for (const wall of p.walls(state.name)) if (wall >= low && wall <= high) line(c, [g.x(k, wall), y - 9], [g.x(k, wall), y + 9], look.bad, 2);
      const x = g.x(k, value);
      line(c, [x, y - 11], [x, y + 11], colour, 5);
      label(c, fitted(c, state.name, g.left - box.x - 12), [g.left - 12, y], look.ink, { align: "right", weight: "600" });
      label(c, withUnit(steady(value, Math.max(-low, high)), state), [g.right + 10, y], look.muted);
    });
  },
  ghost(c, box, p, value, look, role) {
    const g = this.layout(box, p);
    const k = g.names.findIndex((state) => state.name === role);
    return k < 0 ? null : marker(c, [g.x(k, value), g.y(k) - 12], look, 1);
  },
  grips(box, p) {
    const g = this.layout(box, p);
    return g.names.map((state, k) => ({
      role: state.name, direct: true, at: [g.x(k, p.get(state.name)), g.y(k)], radius: Math.max(16, g.pitch / 2),
      to: (point) => {
        const [low, high] = p.span(state.name);
        return low + ((high - low) * (point[0] - g.left)) / (g.right - g.left);
      },
    }));
  },
};

function arc(c, pivot, radius, turn, look) {
  disc(c, pivot, radius, null, look.rule, 1);
  c.beginPath(); // one stroke for all marks
  for (let k = 0; k < 24; k += 1) {
    const at = (k * Math.PI) / 12;
    c.moveTo(...polar(pivot, at, radius));
    c.lineTo(...polar(pivot, at, radius + (k % 6 ? 4 : 9)));
  }
  c.lineWidth = 1;
  c.stroke();
  line(c, polar(pivot, turn.zero, radius - 6), polar(pivot, turn.zero, radius + 9), look.muted, 1.5);
}

/** The set point of an angle: a dashed line that ends in a handle. */
function pointer(c, pivot, angle, length, look) {
  const at = polar(pivot, angle, length);
  line(c, polar(pivot, angle, 14), at, look.ink, 1.25, [5, 5]);
  disc(c, at, 9, look.back, look.ink, 2);
  disc(c, at, 3, look.ink);
  return at;
}

/** The set point of a place: a small triangle; `way` 1 points down, -1 up, 0 right. */
function marker(c, at, look, way) {
  const turn = way === 0 ? 0 : (way * Math.PI) / 2;
  c.beginPath();
  for (const each of [0, 2.3, -2.3]) c.lineTo(...polar(at, turn + each, 11));
  c.closePath();
  c.fillStyle = look.back;
  c.fill();
  c.strokeStyle = look.ink;
  c.lineWidth = 2;
  c.stroke();
  return at;
}

function gear(c, at, radius, angle, look, colour) {
  disc(c, at, radius, look.back, look.ink, 1.5);
  for (let k = 0; k < 8; k += 1) {
    const turn = angle + (k * Math.PI) / 4;
    line(c, polar(at, turn, radius - 4), polar(at, turn, radius), look.muted, 2);
  }
  disc(c, at, 4, colour);
}

/** A muscle from one end to the other; the redder, the harder it works. */
function spindle(c, from, to, swell, look, work) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(dx, dy) || 1;
  const [nx, ny] = [(-dy / length) * swell * 1.6, (dx / length) * swell * 1.6];
  const [mx, my] = [from[0] + dx * 0.45, from[1] + dy * 0.45];
  c.beginPath();
  c.moveTo(...from);
  c.quadraticCurveTo(mx + nx, my + ny, ...to);
  c.quadraticCurveTo(mx - nx, my - ny, ...from);
  c.fillStyle = look.surface;
  c.fill();
  c.globalAlpha *= 0.18 + 0.72 * work;
  c.fillStyle = look.bad;
  c.fill();
  c.globalAlpha /= 0.18 + 0.72 * work;
  c.strokeStyle = look.bad;
  c.lineWidth = 1.25;
  c.stroke();
}

/** A small instrument with a needle: a current, say. */
function meter(c, at, radius, p, role, look) {
  const share = clamp(p.share(role) ?? 0, -1, 1);
  c.beginPath();
  c.arc(at[0], at[1], radius, Math.PI, 0);
  c.closePath();
  c.fillStyle = look.back;
  c.fill();
  c.strokeStyle = look.muted;
  c.lineWidth = 1.25;
  c.stroke();
  line(c, at, polar(at, -Math.PI / 2 + share * 1.2, radius - 4), look.bad, 2);
  label(c, p.shown(role), [at[0], at[1] + 12], look.muted, { align: "center", size: 11 });
}

function ruler(c, box, y, centre, scale, look, above) {
  const [low, high] = [centre - box.w / 2 / scale, centre + box.w / 2 / scale];
  line(c, [box.x + 4, y], [box.x + box.w - 4, y], look.rule, 2);
  for (const tick of ticksBetween(low, high, 6)) {
    const x = box.x + box.w / 2 + (tick - centre) * scale;
    if (x < box.x + 14 || x > box.x + box.w - 14) continue;
    line(c, [x, y], [x, y + (above ? -5 : 5)], look.muted, 1);
    label(c, words(tick), [x, y + (above ? -14 : 15)], look.muted, { align: "center", size: 11 });
  }
}

function wagon(c, at, angle, length, width, fill, edge) {
  c.save();
  c.translate(...at);
  c.rotate(angle);
  block(c, -length / 2, -width / 2, length, width, fill, edge, 5);
  c.restore();
}

function path(c, points, colour) {
  if (points.length < 2) return;
  c.beginPath();
  points.forEach((point, k) => (k ? c.lineTo(...point) : c.moveTo(...point)));
  c.strokeStyle = colour;
  c.globalAlpha = 0.5;
  c.lineWidth = 2;
  c.stroke();
  c.globalAlpha = 1;
}
