// Files -> one uncompressed ZIP file, as PNG data does not compress further. Added data is stored
// as a list of blobs, outside of the heap. Source: APPNOTE.TXT 6.3, sections 4.3.7 to 4.3.16.
import { crc32, utf8, type Bytes } from "./png_text";

const bytesMax = 0xffff_ffff; // larger files, or more than 65,535 of them, would require ZIP64
export const filesMax = 5000;

// Little-endian numbers of 2 or 4 bytes.
function numbers(...fields: [bytes: 2 | 4, value: number][]): Bytes {
  const data = new DataView(new ArrayBuffer(fields.reduce((sum, [bytes]) => sum + bytes, 0)));
  let at = 0;
  for (const [bytes, value] of fields) {
    if (bytes === 2) data.setUint16(at, value, true);
    else data.setUint32(at, value, true);
    at += bytes;
  }
  return new Uint8Array(data.buffer);
}

export class Zip {
  private readonly parts: Blob[] = [];
  private readonly directory: Bytes[] = [];
  private size = 0;
  private readonly time: [2, number][];

  constructor(now: Date) {
    const clock = (now.getHours() << 11) | (now.getMinutes() << 5) | (now.getSeconds() >> 1);
    const day = ((now.getFullYear() - 1980) << 9) | ((now.getMonth() + 1) << 5) | now.getDate();
    this.time = [
      [2, clock],
      [2, day],
    ];
  }

  add(name: string, content: Bytes): void {
    const path = utf8(name);
    const length = content.length;
    // Version 2.0, names in UTF-8, stored; time, CRC, both sizes, length of the name, no extra
    // field.
    const about = numbers(
      [2, 20],
      [2, 0x800],
      [2, 0],
      ...this.time,
      [4, crc32(content)],
      [4, length],
      [4, length],
      [2, path.length],
      [2, 0],
    );
    const local = [numbers([4, 0x04034b50]), about, path, content];
    this.directory.push(
      numbers([4, 0x02014b50], [2, 20]),
      about,
      // no comment; offset of the local header
      numbers([2, 0], [2, 0], [2, 0], [4, 0], [4, this.size]),
      path,
    );
    const part = new Blob(local);
    this.size += part.size;
    this.parts.push(part);
    if (this.size > bytesMax || this.parts.length > filesMax) {
      throw new Error("The frames do not fit into a ZIP file: fewer or smaller ones would.");
    }
  }

  finish(): Blob {
    const directory = new Blob(this.directory);
    const files = this.parts.length;
    const end = numbers(
      [4, 0x06054b50],
      [4, 0], // one disk
      [2, files],
      [2, files],
      [4, directory.size],
      [4, this.size],
      [2, 0],
    );
    return new Blob([...this.parts, directory, end], { type: "application/zip" });
  }
}
