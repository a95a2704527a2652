// Plays the frames of a scene: steps in time one after another, or a mode that swings to and fro.

const PER_SECOND = 8;  // steps in time
const PERIOD = 2;  // seconds of a swing

class Player {
  // `changed` is called where another frame, or another phase of a swing, is to be seen.
  constructor(scene, changed) {
    this.count = scene.frames.length;
    this.oscillates = scene.oscillates;
    this.changed = changed;
    this.frame = 0;
    this.phase = 1;  // by which displacements are multiplied
    this.began = null;
  }

  get plays() {
    return this.began !== null;
  }

  show(frame) {
    this.frame = frame;
    this.changed();
  }

  toggle() {
    this.phase = 1;
    this.began = this.plays ? null : performance.now() - (this.oscillates ? 0 : 1000 * this.frame / PER_SECOND);
    this.changed();
    if (this.plays) requestAnimationFrame((now) => this.#step(now));
  }

  #step(now) {
    if (!this.plays) return;
    const seconds = Math.max(0, now - this.began) / 1000, before = [this.frame, this.phase];
    if (this.oscillates) this.phase = Math.cos(2 * Math.PI * seconds / PERIOD);
    else this.frame = Math.floor(seconds * PER_SECOND) % this.count;
    if (before[0] !== this.frame || before[1] !== this.phase) this.changed();
    requestAnimationFrame((next) => this.#step(next));
  }
}
