// player.js: baked acoustics in Web Audio.
//
//   const clamor = await ClamorContext.create(new AudioContext());
//   const level = await clamor.open("hall.clamor");
//   const ears = await clamor.listen(level, {position_m: [0, 1.7, 3]});
//   ears.connect(clamor.audio.destination);
//   ears.move([1, 1.7, 3], [0, 0, 0, 1]);
//
// A Worker makes keyframes, and an AudioWorklet renders on the same memory; or, on pages that cannot share memory, plays
// what the Worker renders ahead. What fails rejects with an Error that has the library's sentence and its `code` of
// clamor.h. Calls that answer nothing return at once; if they fail, `onlog` hears of it.

const kOutputs = {binaural: 0, loudspeakers: 1, ambisonics: 2, receivers: 3};
const kLead_s = 0.08, kKeyframe_s = 0.02;
const kToldFrames = 512;  // so often a worklet tells the Worker what it has played
const kBesideUs = (file) => new URL(file, import.meta.url);

const wakes_up = (audio) => typeof OfflineAudioContext === "undefined" || !(audio instanceof OfflineAudioContext);

export class ClamorContext {
  // `worker` is a Worker that runs worker.js, and `urls` names worklet.js and clamor.wasm, where they do not
  // lie beside this file; `wasm` is the bytes of the latter.
  static async create(audio, {worker, urls = {}, wasm, onlog = console.warn, ...options} = {}) {
    const context = new ClamorContext();
    Object.assign(context, {audio, onlog, waiting: new Map(), calls: 0, listeners: new Set()});
    context.worker = worker ?? new Worker(new URL("./worker.js", import.meta.url), {type: "module"});
    context.worker.onmessage = ({data}) => context.receive(data);
    context.worker.onerror = (event) => context.fail(event.message ?? "its Worker cannot be loaded");
    const url = String(urls.wasm ?? kBesideUs("./clamor.wasm"));
    await Promise.all([
      context.ask("create", {wasm, options, url}),
      audio.audioWorklet.addModule(urls.worklet ?? kBesideUs("./worklet.js")),
    ]);
    return context;
  }

  // A bake: its address, of which only the parts that are needed are fetched if the server gives ranges, or its bytes in
  // an ArrayBuffer.
  async open(source, name = typeof source === "string" ? source : "the level") {
    const address = typeof source === "string" ? new URL(source, globalThis.document?.baseURI).href : source;
    return new ClamorLevel(this, await this.ask("open", address, name));
  }

  // Options: position_m and orientation; output ("binaural", "loudspeakers" with `layout`, "ambisonics",
  // "receivers"); voices, gain, limits and memory_bytes of clamor_listener_options; lead_s, how far the
  // Worker renders ahead, and 0 where the worklet renders, which takes a page that is cross-origin isolated.
  async listen(level, {position_m = [0, 0, 0], orientation = [0, 0, 0, 1], output = "binaural",
    lead_s = globalThis.crossOriginIsolated ? 0 : kLead_s, ...options} = {}) {
    if (!(output in kOutputs)) throw new RangeError(`there is no output ${output}`);
    if (lead_s === 0 && !globalThis.crossOriginIsolated) throw new RangeError("the page is not cross-origin isolated: a lead is needed");
    const {port1, port2} = new MessageChannel();
    const {listener, channels} = await this.ask("listen", level.handle, {
      output: kOutputs[output], rate_hz: this.audio.sampleRate, pose: {position_m, orientation},
      offline: wakes_up(this.audio) ? 0 : 1, ...options,
    }, {port: port1, lead_frames: Math.ceil(lead_s * this.audio.sampleRate)});
    const waits_s = lead_s || kToldFrames / this.audio.sampleRate;  // until the Worker makes keyframes again
    return new ClamorListener(this, {handle: listener, channels, latency_s: waits_s + kKeyframe_s}, port2);
  }

  // A sound of an AudioBuffer (its first channel), or of samples and their rate.
  async addSound(buffer, {rate_hz = buffer.sampleRate, loops = false} = {}) {
    const samples = buffer.getChannelData ? buffer.getChannelData(0) : buffer;
    return this.ask("add_sound", samples, {rate_hz, loops: loops ? 1 : 0});
  }

  // A source that plays a sound of addSound(), or what an AudioNode gives. Options: position_m, velocity_mps,
  // axis; gain, band_gains, directivity, reverberation.
  async addSource(sound, {position_m, velocity_mps, axis, reverberation, ...options} = {}) {
    const tap = typeof AudioNode !== "undefined" && sound instanceof AudioNode ? sound : null;
    const handle = tap ? await this.tap(tap) : sound;
    const motion = Object.fromEntries(
      Object.entries({position_m, velocity_mps, axis}).filter(([, value]) => value));
    const reflected = reverberation === undefined ? {} : {has_reverberation: 1, reverberation};
    const given = {sound: handle, ...reflected, ...options};
    return new ClamorSource(this, await this.ask("clamor_add_source", {...given, motion}), given, motion);
  }

  async tap(node) {
    const {port1, port2} = new MessageChannel();
    const sound = await this.ask("add_stream", this.audio.sampleRate, port1);
    const processor = new AudioWorkletNode(this.audio, "clamor-tap", {numberOfOutputs: 0});
    processor.port.postMessage(port2, [port2]);
    node.connect(processor);
    return sound;
  }

  close() {
    for (const listener of this.listeners) listener.end();
    this.worker.terminate();
    this.fail("the context is closed");
  }

  // ---- The Worker -------------------------------------------------------------------------------

  tell(call, ...inputs) {
    this.worker.postMessage({call, inputs});
  }

  ask(call, ...inputs) {
    const id = ++this.calls;
    const ports = inputs.map((input) => input?.port).filter((port) => port instanceof MessagePort)
      .concat(inputs.filter((input) => input instanceof MessagePort));
    return new Promise((resolve, reject) => {
      this.waiting.set(id, {resolve, reject});
      this.worker.postMessage({id, call, inputs}, ports);
    });
  }

  receive({id, result, error, code, log}) {
    if (log) this.onlog(log);
    const waiting = this.waiting.get(id);
    this.waiting.delete(id);
    if (error !== undefined) waiting?.reject(Object.assign(new Error(error), {code}));
    else waiting?.resolve(result);
  }

  fail(sentence) {
    for (const {reject} of this.waiting.values()) reject(new Error(sentence));
    this.waiting.clear();
  }
}

class ClamorLevel {
  constructor(context, {level, info, emitters, portals, parts}) {
    Object.assign(this, {context, handle: level, info, emitters, portals, parts});
  }

  // Mutes an emitter, by its number or name, or turns it down: {is_muted, gain}.
  changeEmitter(emitter, {gain, is_muted = false}) {
    const change = gain === undefined ? {} : {has_gain: 1, gain};
    this.context.tell("clamor_change_emitter", this.handle, this.number(this.emitters, emitter),
      {is_muted: is_muted ? 1 : 0, ...change});
  }

  // How open a portal is, 0 to 1.
  setPortal(portal, openness) {
    this.context.tell("clamor_set_portal", this.handle, this.number(this.portals, portal), openness);
  }

  // Turns and moves a door or another movable part.
  movePart(part, position_m, orientation = [0, 0, 0, 1]) {
    const {part: handle} = this.parts[this.number(this.parts, part)];
    this.context.tell("clamor_move_part", handle, {position_m, orientation});
  }

  close() {
    this.context.tell("clamor_close_level", this.handle);
  }

  number(list, name) {
    const number = typeof name === "number" ? name : list.findIndex((each) => each.name === name);
    if (!list[number]) throw new RangeError(`the level has no ${name}`);
    return number;
  }
}

class ClamorListener {
  // `latency_s` is how long after move() it is heard, at most, beside that of the device.
  constructor(context, {handle, channels, latency_s}, port) {
    Object.assign(this, {context, handle, channels, latency_s, missed: 0, queued: 0});
    this.node = new AudioWorkletNode(context.audio, "clamor-listener",
      {numberOfInputs: 0, outputChannelCount: [channels], processorOptions: {told_frames: kToldFrames}});
    this.node.port.onmessage = ({data}) => Object.assign(this, data);
    this.node.port.postMessage(port, [port]);
    context.listeners.add(this);
    if (wakes_up(context.audio)) context.tell("start", handle);
  }

  connect(...destination) {
    return this.node.connect(...destination);
  }

  disconnect(...destination) {
    this.node.disconnect(...destination);
  }

  move(position_m, orientation = [0, 0, 0, 1]) {
    this.context.tell("clamor_move_listener", this.handle, {position_m, orientation});
  }

  // Crossfades to another level. Where the Worker renders, it renders half a second ahead first, so that there is no gap.
  enter(level) {
    return this.context.ask("enter", this.handle, level.handle);
  }

  // Of an OfflineAudioContext: renders that much, before startRendering(). `poses` are {time_s, position_m,
  // orientation}, each for the keyframes from its time on.
  async prepare(seconds, poses) {
    const frames = Math.ceil(seconds * this.context.audio.sampleRate);
    await this.context.ask("prepare", this.handle, frames, poses);
    while (this.queued < frames) {  // an OfflineAudioContext waits for nobody
      this.node.port.postMessage("how much");
      await new Promise((resolve) => { setTimeout(resolve, 10); });
    }
  }

  // Those of clamor_listener_statistics; `missed` counts the quanta of 128 frames that the Worker had not rendered in time.
  // Where the worklet renders, what came late is in the browser's AudioContext.playbackStats.
  async statistics() {
    const counted = await this.context.ask("clamor_get_listener_statistics", this.handle);
    return {...counted, missed: this.missed};
  }

  // What is heard, of a listener with {reports_voices: 1}: an array of clamor_voice.
  voices() {
    return this.context.ask("voices", this.handle);
  }

  close() {
    this.node.disconnect();
    this.end();
    this.context.listeners.delete(this);
    this.context.tell("end", this.handle);
  }

  end() {
    this.node.port.postMessage("ends");
  }
}

class ClamorSource {
  constructor(context, handle, options, motion) {
    Object.assign(this, {context, handle, options, motion});
  }

  move(position_m, velocity_mps, axis) {
    const given = Object.entries({position_m, velocity_mps, axis}).filter(([, value]) => value);
    this.motion = Object.fromEntries(given);
    this.context.tell("clamor_move_source", this.handle, this.motion);
  }

  change(options) {
    Object.assign(this.options, options);
    this.context.tell("clamor_change_source", this.handle, {...this.options, motion: this.motion});
  }

  close() {
    this.context.tell("clamor_remove_source", this.handle);
  }
}
