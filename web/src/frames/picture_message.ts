/** Format of binary messages: a header in JSON, an image and its depth map. */
import type { EditsHeader, HighlightHeader, PictureHeader } from "../net/protocol";

export interface PictureParts {
  header: PictureHeader;
  picture: Uint8Array;
  /** Distances in units of `depth_scale`, row by row; 65535 where the ray hits nothing. */
  depth: Uint16Array;
}

/** The header of a binary message, and the offset of the byte after it. */
export function readHeader(message: ArrayBuffer): {
  header: PictureHeader | EditsHeader | HighlightHeader;
  start: number;
} {
  const length = new DataView(message).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length))) as
    PictureHeader | EditsHeader | HighlightHeader;
  return { header, start: 4 + length };
}

/** The image and the depth map of a message whose header ends at byte `start`. */
export function unpack(message: ArrayBuffer, header: PictureHeader, start: number): PictureParts {
  const picture = new Uint8Array(message, start, header.picture_bytes);
  const at = start + header.picture_bytes;
  return { header, picture, depth: new Uint16Array(message.slice(at, at + header.depth_bytes)) };
}

/** The decoded image: a JPEG off the main thread, raw RGB at once. */
export async function decode(header: PictureHeader, picture: Uint8Array): Promise<ImageBitmap | ImageData> {
  if (header.format === "jpeg") {
    return createImageBitmap(new Blob([picture.slice()]), { colorSpaceConversion: "none" });
  }
  const image = new ImageData(header.width, header.height);
  for (let i = 0, j = 0; i < picture.length; i += 3, j += 4) {
    image.data[j] = picture[i];
    image.data[j + 1] = picture[i + 1];
    image.data[j + 2] = picture[i + 2];
    image.data[j + 3] = 255;
  }
  return image;
}

/** A binary message in the format of the server, for tests. */
export function pack(header: PictureHeader, picture: Uint8Array, depth: Uint16Array): ArrayBuffer {
  const json = new TextEncoder().encode(JSON.stringify(header));
  const bytes = new Uint8Array(4 + json.length + picture.length + depth.byteLength);
  new DataView(bytes.buffer).setUint32(0, json.length, true);
  bytes.set(json, 4);
  bytes.set(picture, 4 + json.length);
  bytes.set(
    new Uint8Array(depth.buffer, depth.byteOffset, depth.byteLength),
    4 + json.length + picture.length,
  );
  return bytes.buffer;
}
