// Height of the view, rad.
const VERTICAL_RAD = 0.85;

// The camera that looks at the scene: a pivot, and where the eye is from it. Angles in rad, distances in m.
class Camera {
  constructor() {
    Object.assign(this, { pivot: [0, 0, 0], distance: 20, yaw: 0, pitch: 0.4 });
  }

  // Right, down, forward.
  axes() {
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    return [[cy, 0, -sy], [-sy * sp, cp, -cy * sp], [sy * cp, sp, cy * cp]];
  }

  eye() {
    return sub(this.pivot, scale(this.axes()[2], this.distance));
  }

  clip(aspect) {
    return clipMatrix(this.eye(), this.axes(), VERTICAL_RAD, aspect, Math.max(0.05, this.distance / 400), Math.max(500, this.distance * 20));
  }

  // Turns about the pivot, or about the eye; what is under the pointer follows it.
  turn(dx, dy, aboutEye) {
    const eye = this.eye(), rate = aboutEye ? -0.003 : 0.005;
    this.yaw += rate * dx;
    this.pitch = clamp(this.pitch + rate * dy, -1.5, 1.5);
    if (aboutEye) this.pivot = add(eye, scale(this.axes()[2], this.distance));
  }

  // Moves by shares of the view's height.
  pan(dx, dy) {
    const [right, down] = this.axes();
    this.pivot = add(this.pivot, add(scale(right, -dx * this.distance), scale(down, -dy * this.distance)));
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.5, 5000);
  }

  // Moves along right, down, forward.
  fly(steps) {
    this.axes().forEach((axis, at) => { this.pivot = add(this.pivot, scale(axis, steps[at])); });
  }

  // Looks along a direction from an eye, or from behind and above it.
  lookFrom(position, forward, behind) {
    this.yaw = Math.atan2(forward[0], forward[2]);
    this.pitch = Math.asin(clamp(forward[1] / length(forward), -1, 1)) + (behind ? 0.42 : 0);
    this.distance = behind ? 22 : 6;
    this.pivot = add(position, scale(forward, behind ? 8 : this.distance));
  }
}

// Keys that fly: right, down, forward.
const KEYS = { KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, 1, 0], KeyE: [0, -1, 0], KeyW: [0, 0, 1], KeyS: [0, 0, -1] };

// Ties pointers, wheel and keys of a canvas to a camera; `mode` names the way it moves, `moved` is called after each change.
function steer(canvas, camera, mode, moved) {
  const pointers = new Map();
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before.x, dy = event.clientY - before.y, apart = pointers.size === 2 ? spread() : 0;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const height = canvas.clientHeight || 1;
    if (pointers.size === 2) {
      camera.zoom(apart / Math.max(spread(), 1));
      camera.pan(dx / height / 2, dy / height / 2);
    } else if (event.buttons & 6 || event.shiftKey) {
      camera.pan(dx / height, dy / height);
    } else {
      camera.turn(dx, dy, mode() === "fly");
    }
    moved();
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const factor = Math.exp(clamp(event.deltaY, -200, 200) * 0.0015);
    if (mode() === "fly") camera.fly([0, 0, (1 - factor) * 10]); else camera.zoom(factor);
    moved();
  }, { passive: false });
  const pressed = new Set();
  let last = 0;
  const flying = (now) => {
    if (!pressed.size) { last = 0; return; }
    const seconds = last ? Math.min((now - last) / 1000, 0.1) : 1 / 60;
    last = now;
    const speed = Math.max(4, camera.distance * 0.6) * seconds;
    for (const key of pressed) camera.fly(scale(KEYS[key], speed));
    moved();
    requestAnimationFrame(flying);
  };
  canvas.addEventListener("keydown", (event) => {
    if (!KEYS[event.code] || event.ctrlKey || event.metaKey || event.altKey) return;
    if (!pressed.size) requestAnimationFrame(flying);
    pressed.add(event.code);
    event.preventDefault();
  });
  canvas.addEventListener("keyup", (event) => pressed.delete(event.code));
  canvas.addEventListener("blur", () => pressed.clear());
}
