import { describe, expect, it } from "vitest";
import { DepthImage } from "../src/frames/depth_image";
import type { PictureHeader } from "../src/net/protocol";
import { readHeader, pack, unpack } from "../src/frames/picture_message";

const HEADER: PictureHeader = {
  type: "picture",
  picture: 7,
  camera: 3,
  drag: 0,
  seq: 0,
  revision: 1,
  view: "color",
  before: false,
  split: null,
  x: 0,
  y: 0,
  width: 4,
  height: 2,
  full_width: 4,
  full_height: 2,
  whole: false,
  refinement: 0,
  final: false,
  format: "jpeg",
  picture_bytes: 3,
  depth_bytes: 16,
  depth_width: 4,
  depth_height: 2,
  depth_scale: 0.5,
  render_ms: 1,
  encode_ms: 1,
};

describe("a binary message", () => {
  it("comes apart into what it was made of", () => {
    const depth = new Uint16Array([1, 2, 3, 4, 5, 6, 7, 65535]);
    const message = pack(HEADER, new Uint8Array([9, 8, 7]), depth);
    const { header, start } = readHeader(message);
    expect(header).toEqual(HEADER);
    const parts = unpack(message, HEADER, start);
    expect([...parts.picture]).toEqual([9, 8, 7]);
    expect([...parts.depth]).toEqual([...depth]);
  });
});

describe("the distances of a picture", () => {
  it("are steps times the scale, and nothing where there is nothing", () => {
    const image = new DepthImage();
    image.addPart(HEADER, new Uint16Array([1, 2, 3, 4, 5, 6, 7, 65535]));
    expect(image.at(0.1, 0.1)).toBeCloseTo(0.5, 6);
    expect(image.at(0.6, 0.9)).toBeCloseTo(3.5, 6);
    expect(image.at(0.9, 0.9)).toBeNull();
  });

  it("keep what was there where only a finer tile came", () => {
    const image = new DepthImage();
    image.addPart(HEADER, new Uint16Array([2, 2, 2, 2, 2, 2, 2, 2]));
    const tile = {
      ...HEADER,
      x: 4,
      y: 2,
      width: 4,
      height: 2,
      full_width: 8,
      full_height: 4,
      depth_width: 4,
      depth_height: 2,
    };
    image.addPart(tile, new Uint16Array(8).fill(20));
    expect([image.width, image.height]).toEqual([8, 4]);
    expect(image.at(0.9, 0.9)).toBeCloseTo(10, 6);
    expect(image.at(0.1, 0.9)).toBeCloseTo(1, 6);
    expect(image.at(0.9, 0.1)).toBeCloseTo(1, 6);
  });

  it("take a part whose depth is coarser than its picture", () => {
    const image = new DepthImage();
    const part = {
      ...HEADER,
      width: 8,
      height: 8,
      full_width: 16,
      full_height: 8,
      x: 8,
      depth_width: 2,
      depth_height: 2,
    };
    image.addPart(part, new Uint16Array([2, 4, 6, 8]));
    expect([image.width, image.height]).toEqual([4, 2]);
    expect(image.at(0.99, 0.99)).toBeCloseTo(4, 6);
    expect(image.at(0.2, 0.5)).toBeNull();
  });
});
