// remote_bake.js: a bake on a static server, of which only the parts that are read are fetched.
//
// The library reads synchronously, and so does a Worker's XMLHttpRequest; while it waits for the server,
// nothing is rendered. read_ahead() therefore fetches the rest in the background, once sound plays.
// What is fetched is kept, up to kKeptBytes; of that, what was fetched first is forgotten first.

const kPieceBytes = 1 << 11;
const kAheadBytes = 1 << 18;
const kKeptBytes = 1 << 26;

const range = (from, end) => `bytes=${from}-${end - 1}`;

export class RemoteBake {
  // The file at an address; or its bytes, where the server gives no parts of it.
  static async open(address) {
    const ask = async (options) => {
      const answer = await fetch(address, options);
      if (!answer.ok) throw new Error(`${address}: the server answers ${answer.status} ${answer.statusText}`);
      return answer;
    };
    const first = await ask({headers: {Range: range(0, kPieceBytes)}});
    if (first.status !== 206) return first.arrayBuffer();
    // Other origins show this header only if they expose it.
    const size = /\/(\d+)$/.exec(first.headers.get("Content-Range"))?.[1];
    if (!size) return (await ask({})).arrayBuffer();
    const bake = new RemoteBake(address, Number(size));
    bake.keep(0, new Uint8Array(await first.arrayBuffer()));
    return bake;
  }

  constructor(address, size) {
    Object.assign(this, {address, size, pieces: new Map()});
  }

  // Fills `into` with the bytes from `offset` on.
  read(offset, into) {
    const end = offset + into.length;
    this.fetch_missing(Math.floor(offset / kPieceBytes), Math.ceil(end / kPieceBytes));
    for (let at = offset; at < end;) {
      const begin = at - at % kPieceBytes;
      const part = this.pieces.get(begin / kPieceBytes).subarray(at - begin, end - begin);
      into.set(part, at - offset);
      at += part.length;
    }
    while (this.pieces.size * kPieceBytes > kKeptBytes) this.pieces.delete(this.pieces.keys().next().value);
  }

  // Pieces that follow each other by one request.
  fetch_missing(first, last) {
    for (let piece = first; piece < last; ++piece) {
      const begin = piece;
      while (piece < last && !this.pieces.has(piece)) ++piece;
      if (piece > begin) this.keep(begin, this.fetch_now(...this.bytes_of(begin, piece)));
    }
  }

  bytes_of(first, last) {
    return [first * kPieceBytes, Math.min(last * kPieceBytes, this.size)];
  }

  fetch_now(from, end) {
    const request = new XMLHttpRequest();
    request.open("GET", this.address, false);
    request.responseType = "arraybuffer";
    request.setRequestHeader("Range", range(from, end));
    request.send();
    if (request.status !== 206 || request.response.byteLength !== end - from)
      throw new Error(`${this.address}: the server answers ${request.status} when asked for a part`);
    return new Uint8Array(request.response);
  }

  keep(first, bytes) {
    for (let at = 0; at < bytes.length; at += kPieceBytes)
      this.pieces.set(first + at / kPieceBytes, bytes.subarray(at, at + kPieceBytes));
  }

  // Fetches what is not there from the end on, where the upper part of the octree is, unless the file has more than
  // `most_bytes` or is closed.
  async read_ahead(most_bytes = kKeptBytes) {
    if (this.is_ahead || this.size > Math.min(most_bytes, kKeptBytes)) return;
    this.is_ahead = true;
    const many = kAheadBytes / kPieceBytes;
    for (let piece = Math.floor((this.size - 1) / kAheadBytes) * many; piece >= 0 && !this.is_closed; piece -= many) {
      const [from, end] = this.bytes_of(piece, piece + many);
      const all = Array.from({length: Math.ceil((end - from) / kPieceBytes)}, (_, i) => piece + i);
      if (all.every((one) => this.pieces.has(one))) continue;
      const answer = await fetch(this.address, {headers: {Range: range(from, end)}}).catch(() => null);
      if (answer?.status !== 206) return;  // a read tells why
      const bytes = new Uint8Array(await answer.arrayBuffer());
      if (bytes.length === end - from) this.keep(piece, bytes);
    }
  }
}
