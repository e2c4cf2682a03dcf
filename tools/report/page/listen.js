// listen.js: sounds a report: the player of @clamor/player with the bake of the page, whose listener is the
// view's. The head looks where the view looks.

// The text of an element that the page carries.
const carried = (id) => document.getElementById(id).textContent;
// In a page from a disk, Chromium's Worker takes a Blob, and its worklet a data: URL.
const workerOf = (id) => new Worker(URL.createObjectURL(new Blob([carried(id)], {type: "text/javascript"})));
const scriptOf = (id) => "data:text/javascript," + encodeURIComponent(carried(id));

class Listening {
  constructor(view, button, status) {
    Object.assign(this, {view, button, status, ears: null});
    button.addEventListener("click", () => (this.audio?.state === "running" ? this.pause() : this.play()));
  }

  async play() {
    this.button.disabled = true;
    try {
      this.audio ??= new AudioContext();
      const resumed = this.audio.resume();  // which never answers where there is no sound device
      this.ears ??= await this.begin();
      const late = new Promise((_, reject) => { setTimeout(() => reject(new Error("The browser's sound does not start: is there a device?")), 5000); });
      await Promise.race([resumed, late]);
      this.button.textContent = "Pause";
      this.tell();
      this.follow();
    } catch (error) {
      this.status.textContent = error.message;
    }
    this.button.disabled = false;
  }

  async pause() {
    await this.audio.suspend();
    this.button.textContent = "Listen";
  }

  async begin() {
    this.status.textContent = "Reading the bake …";
    this.clamor = await ClamorContext.create(this.audio, {
      worker: workerOf("listen-worker"), urls: {worklet: scriptOf("listen-worklet")}, wasm: bytesOf(carried("listen-wasm")),
      onlog: (sentence) => { this.status.textContent = sentence; }});
    const bakes = ["listen-bake", "listen-other"].filter((id) => document.getElementById(id) !== null);
    this.levels = await Promise.all(bakes.map((id) => this.clamor.open(bytesOf(carried(id)), document.title)));
    const ears = await this.clamor.listen(this.levels[0], {...this.pose(), limits: 1, reports_voices: 1});
    ears.connect(this.audio.destination);
    this.offerDoors();
    if (this.levels.length > 1) this.offer("the other bake", false, (is_other) => ears.enter(this.levels[is_other]));
    return ears;
  }

  pose() {
    const {camera} = this.view, {right} = camera.axes();
    const yaw = Math.atan2(-right[2], right[0]);
    return {position_m: [0, 1, 2].map((axis) => this.view.inWorld(axis)), orientation: [0, Math.sin(yaw / 2), 0, Math.cos(yaw / 2)]};
  }

  // The listener and the head go where the view's go, once a picture.
  follow() {
    if (this.audio.state !== "running") return;
    const pose = this.pose(), key = JSON.stringify(pose);
    if (key !== this.key) this.ears.move(pose.position_m, pose.orientation);
    this.key = key;
    requestAnimationFrame(() => this.follow());
  }

  async tell() {
    while (this.audio.state === "running") {
      const {voices, missed} = await this.ears.statistics();
      this.status.textContent = `${voices} voices, for headphones` + (missed > 0 ? `; ${missed} blocks came late` : "");
      const {right} = this.view.camera.axes();  // and ahead of the listener is (right z, 0, -right x)
      this.view.showHeard((await this.ears.voices()).map(({direction: [x, y, z], band_gains, delay_s}) => ({delay_s,
        toward: [x * right[0] - z * right[2], y, x * right[2] + z * right[0]],
        level_db: 10 * Math.log10(band_gains.reduce((sum, gain) => sum + gain * gain, 1e-30))})));
      await new Promise((resolve) => { setTimeout(resolve, 1000); });
    }
  }

  offer(text, checked, change) {
    const label = document.createElement("label"), box = document.createElement("input");
    Object.assign(box, {type: "checkbox", checked});
    box.addEventListener("change", () => change(box.checked ? 1 : 0));
    label.append(box, text);
    this.status.before(label);
    return box;
  }

  // Each portal has a box; a click on it in the view is one on the box.
  offerDoors() {
    const {canvas, level: {portals}} = this.view;
    for (const portal of portals)
      portal.box = this.offer(`${portal.name} is open`, true, (openness) => {
        for (const level of this.levels) if (level.portals.some(({name}) => name === portal.name)) level.setPortal(portal.name, openness);
        this.view.paintMarkers();
        this.view.redraw();
      });
    if (portals.length > 0) document.querySelector(".note.keys").append(" A click on a portal closes or opens it.");
    let pressed;
    canvas.addEventListener("pointerdown", ({clientX, clientY}) => { pressed = [clientX, clientY]; });
    canvas.addEventListener("click", ({clientX, clientY}) => {
      if (Math.hypot(clientX - pressed[0], clientY - pressed[1]) < 4) this.portalAt(clientX, clientY)?.box.click();
    });
  }

  // The portal nearest to the eye of those that are seen at a place of the window.
  portalAt(clientX, clientY) {
    const {camera, canvas, level: {portals}} = this.view, {left, top, width, height} = canvas.getBoundingClientRect();
    const point = [2 * (clientX - left) / width - 1, 1 - 2 * (clientY - top) / height];
    const side = ([ax, ay], [bx, by]) => (bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax) > 0;
    const isHit = (portal) => {
      const corners = cornersOf(portal).map((corner) => camera.project(corner, width / height));
      if (corners.includes(null)) return false;
      const sides = corners.map((corner, k) => side(corner, corners[(k + 1) % 4]));
      return sides.every((one) => one === sides[0]);
    };
    const far = ({centre}) => Math.hypot(...minus(centre, camera.eye()));
    return portals.filter(isHit).sort((a, b) => far(a) - far(b))[0];
  }
}

document.getElementById("heard").insertAdjacentHTML("beforebegin",
  '<fieldset><legend>Sound</legend><button type="button" id="listen">Listen</button> <span class="note" id="listen-status" role="status"></span></fieldset>');
window.clamorListening = new Listening(window.clamorView, document.getElementById("listen"), document.getElementById("listen-status"));
