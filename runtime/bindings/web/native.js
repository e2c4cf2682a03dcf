// native.js: the functions of clamor.h on a module that createClamor() of clamor.mjs has made.
//
//   const native = new Native(await createClamor());
//   const context = native.call("clamor_create", {caller_updates: 1});
//   const level = native.open(context, bytes, "hall.clamor");
//   const ears = native.call("clamor_create_listener", context, level, {rate_hz: 48000});
//
// call() takes what a function reads: numbers, handles as BigInt, texts, and structures as objects
// whose members may be left out. It returns what the function writes: nothing, a value, an object, or
// an array of several. What fails throws an Error with the library's sentence and its `code`.
import {functions, structures} from "./declarations.js";

export {constants} from "./declarations.js";

const accessors = {
  char: "Int8", int32_t: "Int32", uint32_t: "Uint32", pointer: "Uint32", string: "Uint32",
  float: "Float32", double: "Float64", int64_t: "BigInt64", uint64_t: "BigUint64",
};
const sizes = {char: 1, int32_t: 4, uint32_t: 4, pointer: 4, string: 4, float: 4};
const size_of = (kind) => structures[kind]?.size ?? sizes[kind] ?? 8;
const kScratchBytes = 1 << 16;

// createClamor() for a WebAssembly.Module, of which a worklet can have another instance on the same memory.
export function instantiate(createClamor, module) {
  return createClamor({instantiateWasm(imports, done) {
    const instance = new WebAssembly.Instance(module, imports);
    done(instance, module);
    return instance.exports;
  }});
}

export class Native {
  constructor(module) {
    this.module = module;
    this.scratch = module._malloc(kScratchBytes);
  }

  get view() {
    if (this.view_?.buffer !== this.module.HEAPU8.buffer)  // the memory has grown
      this.view_ = new DataView(this.module.HEAPU8.buffer);
    return this.view_;
  }

  call(name, ...inputs) {
    const [result, ...parameters] = functions[name];
    this.used = this.scratch;
    const outputs = [];
    const values = parameters.map((kind) => {
      if (!kind.startsWith("=")) return this.pass(kind, inputs.shift());
      const output = {kind: kind.slice(1)};
      output.at = this.pass_zeros(output.kind);
      outputs.push(output);
      return output.at;
    });
    const code = this.module["_" + name](...values);
    if (result !== "int32_t") return result === "const char*" ? this.module.UTF8ToString(code) : code;
    const written = outputs.map(({kind, at}) => this.read(kind, at));
    const error = outputs.at(-1)?.kind === "clamor_error" ? written.pop() : null;
    if (code < 0) throw this.failure(code, error?.sentence);
    return written.length > 1 ? written : written[0];
  }

  failure(code, sentence) {
    return Object.assign(new Error(sentence || this.module.UTF8ToString(this.module._clamor_result_text(code))), {code});
  }

  // Copies an array of floats or bytes into memory that the caller frees by release().
  keep(array) {
    const at = this.module._malloc(Math.max(array.byteLength, 1));
    if (at === 0) throw new Error(`there is no memory for ${array.byteLength} bytes`);
    this.module.HEAPU8.set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength), at);
    return at;
  }

  release(at) {
    this.module._free(at);
  }

  // Opens a bake that is an ArrayBuffer or a Uint8Array, and copies it.
  open(context, bytes, name = "the level") {
    const copy = new Uint8Array(bytes);
    const memory = this.keep(copy);
    this.freer ??= this.module.addFunction((at) => this.release(at), "vi");
    try {
      return this.call("clamor_open_level_with", context,
        {name, size: BigInt(copy.length), memory, user: memory, release: this.freer});
    } catch (error) {
      this.release(memory);
      throw error;
    }
  }

  // Opens a bake of `size` bytes whose read(offset, into) fills a Uint8Array at once, or throws. What it throws,
  // `log` is told.
  open_with(context, bake, name = "the level", log = console.warn) {
    this.bakes ??= new Map();
    this.reader ??= this.module.addFunction((user, offset, count, into) => {
      const {bake: opened, log: told} = this.bakes.get(user);
      try {
        opened.read(Number(offset), this.module.HEAPU8.subarray(into, into + Number(count)));
        return 0;
      } catch (error) {
        told(error.message);
        return 1;
      }
    }, "iijji");
    this.closer ??= this.module.addFunction((user) => {
      this.bakes.get(user).bake.is_closed = true;
      this.bakes.delete(user);
    }, "vi");
    const user = this.users = (this.users ?? 0) + 1;
    this.bakes.set(user, {bake, log});
    try {
      return this.call("clamor_open_level_with", context,
        {name, size: BigInt(bake.size), user, read: this.reader, release: this.closer});
    } catch (error) {
      this.bakes.delete(user);
      throw error;
    }
  }

  // A mono sound of a Float32Array.
  add_sound(context, samples, options) {
    const at = this.keep(samples);
    try {
      return this.call("clamor_add_sound", context, at, BigInt(samples.length), options);
    } finally {
      this.release(at);
    }
  }

  // The voices of a listener with reports_voices in its newest keyframe, each a clamor_voice.
  voices(context, listener, most = 4096) {
    const {size} = structures.clamor_voice;
    const voices = this.module._malloc(most * size);
    this.used = this.scratch;
    const asked = this.pass("clamor_voices", {capacity: most, voices});
    try {
      const code = this.module._clamor_get_voices(context, listener, asked);
      if (code < 0) throw this.failure(code);
      const count = Math.min(this.read("clamor_voices", asked).count, most);
      return Array.from({length: count}, (_, i) => this.read("clamor_voice", voices + i * size));
    } finally {
      this.release(voices);
    }
  }

  // ---- Passing ----------------------------------------------------------------------------------

  take(bytes) {
    const at = this.used = (this.used + 7) & ~7;
    if (at + bytes > this.scratch + kScratchBytes) throw new RangeError("a text is too long");
    this.used += bytes;
    return at;
  }

  pass_zeros(kind) {
    const at = this.take(size_of(kind));
    this.module.HEAPU8.fill(0, at, at + size_of(kind));
    const bytes = structures[kind]?.members.bytes;
    if (bytes) this.view.setUint32(at, size_of(kind), true);
    return at;
  }

  pass(kind, value) {
    if (kind === "string") return value == null ? 0 : this.pass_text(value);
    if (!structures[kind]) return kind === "uint64_t" ? BigInt(value) : Number(value ?? 0);
    if (value == null) return 0;
    const at = this.pass_zeros(kind);
    this.write(kind, at, value);
    return at;
  }

  pass_text(text) {
    const bytes = this.module.lengthBytesUTF8(text) + 1;
    const at = this.take(bytes);
    this.module.stringToUTF8(text, at, bytes);
    return at;
  }

  write(kind, at, value) {
    if (structures[kind]) {
      for (const [member, given] of Object.entries(value)) {
        const layout = structures[kind].members[member];
        if (!layout) throw new TypeError(`${kind} has no member ${member}`);
        const [offset, type, count] = layout;
        if (count > 0)
          given.forEach((each, i) => i < count && this.write(type, at + offset + i * size_of(type), each));
        else this.write(type, at + offset, given);
      }
    } else {
      const passed = kind === "string" ? this.pass(kind, value) : value;
      const number = accessors[kind].startsWith("Big") ? BigInt(passed) : Number(passed);
      this.view["set" + accessors[kind]](at, number, true);
    }
  }

  read(kind, at) {
    if (!structures[kind]) {
      const value = this.view["get" + accessors[kind]](at, true);
      return kind === "string" ? this.module.UTF8ToString(value) : value;
    }
    return Object.fromEntries(Object.entries(structures[kind].members).map(([member, layout]) => {
      const [offset, type, count] = layout;
      if (type === "char") return [member, this.module.UTF8ToString(at + offset)];
      if (count === 0) return [member, this.read(type, at + offset)];
      return [member, Array.from({length: count}, (_, i) => this.read(type, at + offset + i * size_of(type)))];
    }));
  }
}
