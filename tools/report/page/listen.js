// listen.js: sounds a report: the player of @clamor/player with the bake of the page, whose listener is the
// view's. The head looks where the view looks.

// The text or the bytes of an element that the page carries.
const carried = (id) => document.getElementById(id).textContent;
const bytesOf = async (id) => (await fetch("data:application/octet-stream;base64," + carried(id))).arrayBuffer();
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
      await this.audio.resume();
      this.ears ??= await this.begin();
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
      worker: workerOf("listen-worker"), urls: {worklet: scriptOf("listen-worklet")}, wasm: await bytesOf("listen-wasm"),
      onlog: (sentence) => { this.status.textContent = sentence; }});
    const level = await this.clamor.open(await bytesOf("listen-bake"), document.title);
    const ears = await this.clamor.listen(level, {...this.pose(), limits: 1});
    ears.connect(this.audio.destination);
    this.offerDoors(level);
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
      await new Promise((resolve) => { setTimeout(resolve, 1000); });
    }
  }

  offerDoors(level) {
    level.portals.forEach((portal, number) => {
      const label = document.createElement("label"), box = document.createElement("input");
      Object.assign(box, {type: "checkbox", checked: true});
      box.addEventListener("change", () => level.setPortal(number, box.checked ? 1 : 0));
      label.append(box, `${portal.name} is open`);
      this.status.before(label);
    });
  }
}

document.getElementById("heard").insertAdjacentHTML("beforebegin",
  '<fieldset><legend>Sound</legend><button type="button" id="listen">Listen</button> <span id="listen-status" role="status"></span></fieldset>');
window.clamorListening = new Listening(window.clamorView, document.getElementById("listen"), document.getElementById("listen-status"));
