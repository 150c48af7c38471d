import { describe, expect, it } from "vitest";
import { layoutBytes, TexelWriter, createLayout, TooLarge } from "../src/field/atlas";
import { deviceLimit } from "../src/field/gl";
import { joinBytePlanes, undoDifferences } from "../src/field/level";
import type { Level, Vec3 } from "../src/field/level";
import { AdaptiveResolution } from "../src/field/adaptive_resolution";
import { memoryLimit, RenderLocation } from "../src/field/render_location";
import { isBent } from "../src/field/edits_glsl";
import { EDIT_LAYOUT } from "../src/field/layout";
import { replacePart } from "../src/field/page_edits";
import { buildLayerIndex, changedBricks, readLayer } from "../src/field/page_layers";
import type { Layer } from "../src/field/page_layers";
import { OffsetAllocator } from "../src/field/layer_offsets";
import { VertexIndex } from "../src/field/quantized_vertices";
import { ByteReader, PageFile } from "../src/field/page_file";
import { ProgressiveStill, SETTLE_MS } from "../src/field/progressive_still";
import { Orbit } from "../src/viewer/orbit";
import { viewAt } from "../src/viewer/camera_path";

/** A field of 10 x 9 x 9 vertices, all stored, whose vertex (x, y, z) has the density 100 x + 10 y + z. */
function level(): Level {
  const resolution: Vec3 = [10, 9, 9];
  const bricks = [2, 2, 2];
  const masks: number[] = [];
  const density: number[] = [];
  for (let b = 0; b < 8; b++) {
    const at = [(b >> 2) * 8, ((b >> 1) & 1) * 8, (b & 1) * 8];
    for (let byte = 0; byte < 64; byte++) {
      let mask = 0;
      for (let bit = 0; bit < 8; bit++) {
        const v = 8 * byte + bit;
        const [x, y, z] = [at[0] + (v >> 6), at[1] + ((v >> 3) & 7), at[2] + (v & 7)];
        if (x >= resolution[0] || y >= resolution[1] || z >= resolution[2]) continue;
        mask |= 1 << bit;
        density.push(100 * x + 10 * y + z);
      }
      masks.push(mask);
    }
  }
  const count = density.length;
  return {
    field: {
      bounds: [
        [0, 0, 0],
        [1, 1, 1],
      ],
      contracted: false,
      step: 0.5,
      background: null,
      brick: 8,
      levels: [],
    },
    header: { resolution, vertices: count, unit: 1, steps: [1], dims: [3, 2, 2] },
    last: true,
    bricks: new Uint8Array(bricks[0] * bricks[1] * bricks[2]).fill(1),
    masks: Uint8Array.from(masks),
    density: Uint16Array.from(density),
    sh: Uint8Array.from({ length: 3 * count }, (_, n) => (n < count ? density[n] & 255 : 7)),
    occupancy: { origin: [0, 0, 0], dims: [3, 2, 2], codes: new Uint16Array(12).fill(255) },
  };
}

describe("bricks in textures", () => {
  it("repeat the vertices of the bricks behind them", () => {
    const layout = createLayout(level(), 256);
    expect(layout.dims).toEqual([2, 1, 1]);
    expect(layout.count).toBe(2);
    const filler = new TexelWriter(layout, [VertexIndex.fromLevel(level())]);
    const width = layout.atlasBricks[0] * 9;
    const slice = width * layout.atlasBricks[1] * 9;
    for (let n = 0; n < 2; n++) {
      const [i, j, k] = layout.index.subarray(4 * layout.bricks[n]);
      const plane = layout.atlasBricks[0] * layout.atlasBricks[1];
      const layer = filler.texels(
        layout.bricks.subarray(k * plane, (k + 1) * plane),
        layout.atlasBricks[0],
        layout.atlasBricks[1],
      );
      const at = (x: number, y: number, z: number): number => x * slice + (j * 9 + y) * width + i * 9 + z;
      for (const [x, y, z] of [
        [0, 0, 0],
        [1, 8, 3],
        [1, 2, 8],
      ] as Vec3[]) {
        const value = 100 * (8 * n + x) + 10 * y + z;
        expect(layer.density[at(x, y, z)]).toBe(value);
        expect(layer.colors[0][4 * at(x, y, z)]).toBe(value & 255);
        expect(layer.colors[0][4 * at(x, y, z) + 1]).toBe(7);
      }
      // Beyond the grid there is nothing: gray without density.
      if (n === 1) expect([layer.density[at(5, 0, 0)], layer.colors[0][4 * at(5, 0, 0)]]).toEqual([0, 128]);
      else expect(layer.density[at(8, 1, 1)]).toBe(811);
    }
    expect(layoutBytes(layout)).toBe(layout.atlasBricks.reduce((a, b) => a * b) * 729 * 6 + 8);
  });

  it("are refused where textures are too small", () => {
    expect(() => createLayout(level(), 9)).toThrow(TooLarge);
  });
});

/**
 * A layer of the same grid: vertex (9, 0, 0) has the density 7, and (9, 1, 0) none; brick 0 is as the
 * field's.
 */
function layer(key: string, cells = [0, 1]): Layer {
  const masks = new Uint8Array(64);
  // Of brick 1, in which (9, 0, 0) and (9, 1, 0) are the places 64 and 72.
  masks[8] = 1;
  masks[9] = 1;
  return {
    key,
    low: [0, 0, 0],
    dims: [2, 1, 1],
    cells: Uint8Array.from(cells),
    bricks: Uint8Array.from([0, 1]),
    masks,
    density: Uint16Array.from([7, 0]),
    sh: Uint8Array.from([1, 128, 2, 128, 3, 128]),
  };
}

describe("layers of a field", () => {
  it("are unpacked from their arrays", async () => {
    const arrays: [string, string, Uint8Array<ArrayBuffer>][] = [
      ["box", "i4", new Uint8Array(Int32Array.from([1, 2, 3, 1, 1, 2]).buffer)],
      ["cells", "u1", Uint8Array.from([0, 2])],
      ["bricks", "u1", Uint8Array.from([1, 0])],
      ["masks", "u1", new Uint8Array(64).fill(3, 0, 1)],
      ["density", "u1", Uint8Array.from([1, 2, 3, 4])],
      ["sh", "u1", Uint8Array.from([1, 1, 0, 255, 2, 0])],
    ];
    const deflated = async (data: Uint8Array<ArrayBuffer>): Promise<Uint8Array> =>
      new Uint8Array(
        await new Response(
          new Blob([data]).stream().pipeThrough(new CompressionStream("deflate")),
        ).arrayBuffer(),
      );
    const blobs = await Promise.all(arrays.map(([, , data]) => deflated(data)));
    const entries = arrays.map(([name, type], n) => ({
      name: `layer.0.${name}`,
      type,
      shape: [],
      bytes: blobs[n].length,
    }));
    const text = new TextEncoder().encode(JSON.stringify({ arrays: entries }));
    const start = new Uint8Array(16);
    start.set(new TextEncoder().encode("somefile"));
    new DataView(start.buffer).setUint32(8, 1, true);
    new DataView(start.buffer).setUint32(12, text.length, true);
    const whole = Uint8Array.from([...start, ...text, ...blobs.flatMap((blob) => [...blob])]);
    const read = await readLayer(
      await PageFile.open(new ByteReader(whole.buffer), "somefile", 1),
      "layer.0",
      "a",
    );
    expect([read.key, read.low, read.dims]).toEqual(["a", [1, 2, 3], [1, 1, 2]]);
    expect([[...read.cells], [...read.density], [...read.sh]]).toEqual([
      [0, 2],
      [0x301, 0x402],
      [129, 130, 128, 127, 130, 130],
    ]);
    const stored = new VertexIndex(read, 8, read.low, read.dims);
    expect([
      stored.slot(8, 16, 24),
      stored.slot(8, 16, 25),
      stored.slot(8, 16, 26),
      stored.slot(7, 16, 24),
    ]).toEqual([0, 1, -1, -1]);
  });

  it("have their own vertices, and the field's where they have none", () => {
    const layout = createLayout(level(), 256, 3);
    const stored = [new VertexIndex(layer("a"), 8, [0, 0, 0], [2, 1, 1]), VertexIndex.fromLevel(level())];
    const { density, colors: colors } = new TexelWriter(layout, stored).texels([1], 1, 1);
    expect([...density.subarray(81, 81 + 3)]).toEqual([7, 901, 902]);
    expect([...colors[0].subarray(4 * 81, 4 * 81 + 3)]).toEqual([1, 2, 3]);
    // Emptied there, and not what the field has.
    expect([density[81 + 9], density[81 + 10]]).toEqual([0, 911]);
    expect(density[0]).toBe(800);
  });

  it("are found behind the field, the bricks that are as the field's where these are", () => {
    const layout = createLayout(level(), 256, 3);
    const entry = (index: Uint8Array, brick: number): number[] => [
      ...index.subarray(4 * brick, 4 * brick + 4),
    ];
    const [first, second] = [layer("a"), layer("b", [2, 0])];
    expect([...changedBricks(first, layout)]).toEqual([1]);
    expect([...changedBricks(second, layout)]).toEqual([]);
    const layers = [
      { layer: first, place: 2, first: 0, end: 2 },
      { layer: second, place: 4, first: -1, end: 2 },
    ];
    const { dims, index } = buildLayerIndex(layout, layers, (each) => (each === first ? [2] : []));
    expect(dims).toEqual([6, 1, 1]);
    const place = (n: number): number[] => [
      n % layout.atlasBricks[0],
      Math.floor(n / layout.atlasBricks[0]) % layout.atlasBricks[1],
      Math.floor(n / (layout.atlasBricks[0] * layout.atlasBricks[1])),
      255,
    ];
    expect(entry(index, 0)).toEqual(place(0));
    expect(entry(index, 2)).toEqual(place(0));
    expect(entry(index, 3)).toEqual(place(2));
    expect(entry(index, 4)).toEqual([0, 0, 0, 0]);
    expect(entry(index, 5)).toEqual(place(1));
  });

  it("take places, keep them, and free them once they are not used", () => {
    const places = new OffsetAllocator(10, 15);
    expect([...(places.allocate("a", 2) ?? [])]).toEqual([10, 11]);
    expect([...(places.allocate("b", 2) ?? [])]).toEqual([12, 13]);
    expect(places.allocate("c", 2)).toBeNull();
    expect([places.left, places.get("c")]).toEqual([1, null]);
    places.retain(new Set(["b"]));
    expect([places.left, places.get("a")]).toEqual([3, null]);
    expect([...(places.allocate("c", 3) ?? [])]).toEqual([10, 11, 14]);
    expect([...(places.get("b") ?? [])]).toEqual([12, 13]);
    places.retain(new Set());
    expect(places.left).toBe(5);
  });
});

describe("files for pages", () => {
  it("are read however they are cut, and refused where they end early", async () => {
    const text = new TextEncoder().encode('{"arrays":[]}');
    const bytes = new Uint8Array([
      ...new TextEncoder().encode("somefile"),
      1,
      0,
      0,
      0,
      text.length,
      0,
      0,
      0,
      ...text,
    ]);
    const cut = (end: number): ReadableStream<Uint8Array<ArrayBuffer>> =>
      new ReadableStream({
        start(controller): void {
          for (let n = 0; n < end; n += 5) controller.enqueue(bytes.slice(n, Math.min(end, n + 5)));
          controller.close();
        },
      });
    const open = (end: number): Promise<unknown> => PageFile.open(new ByteReader(cut(end)), "somefile", 1);
    await expect(open(bytes.length)).resolves.toMatchObject({ left: 0 });
    await expect(open(20)).rejects.toThrow("truncated");
    await expect(PageFile.open(new ByteReader(cut(29)), "somefile", 2)).rejects.toThrow(
      "of version 1, this page reads 2",
    );
    await expect(PageFile.open(new ByteReader(cut(29)), "otherone", 1)).rejects.toThrow(
      "not a file of the kind",
    );
  });

  it("have differences and split bytes", () => {
    expect([...joinBytePlanes(Uint8Array.from([1, 2, 3, 4]))]).toEqual([0x301, 0x402]);
    expect([...undoDifferences(Uint8Array.from([1, 2, 250, 3]), 2)]).toEqual([129, 131, 122, 125]);
  });
});

describe("adaptive resolution", () => {
  it("draws smaller frames at a higher cost of a pixel, and complete ones in bands", () => {
    const resolution = new AdaptiveResolution(20, 40);
    resolution.record(10_000, 1);
    expect(resolution.scale(200, 100)).toBe(1);
    expect(resolution.scale(1000, 800)).toBe(0.5);
    expect(resolution.bandRows(1000, 800)).toBe(400);
  });
});

describe("a still frame", () => {
  it("starts after a time without changes, is drawn in bands, and restarts after a change", () => {
    const still = new ProgressiveStill();
    still.restart(1000, false);
    expect(still.nextBand(1000 + SETTLE_MS - 1, 100, 60)).toBeNull();
    const first = still.nextBand(1000 + SETTLE_MS, 100, 60);
    expect(first).toEqual({ first: 0, count: 60 });
    expect(still.finishBand({ first: 0, count: 60 }, 100)).toBe(false);
    expect(still.nextBand(1100, 100, 60)).toEqual({ first: 60, count: 40 });
    still.restart(1101, false);
    expect(still.nextBand(1101 + SETTLE_MS, 100, 100)).toEqual({ first: 0, count: 100 });
    expect(still.finishBand({ first: 0, count: 100 }, 100)).toBe(true);
    expect([still.isComplete, still.nextBand(2000, 100, 100)]).toEqual([true, null]);
    still.restart(3000, true);
    expect(still.nextBand(4000, 100, 100)).toBeNull();
  });
});

describe("the render location", () => {
  it("is the page, until it has been measured to be slower than the server", () => {
    const location = new RenderLocation();
    location.recordServer(10_000, 20, false);
    for (let n = 0; n < 5; n++) location.recordPage(10_000, 80);
    expect(location.serverIsFaster).toBe(false);
    location.recordPage(10_000, 80);
    expect(location.serverIsFaster).toBe(true);
    // From the first moving frame on, still frames do not count.
    location.recordServer(10_000, 70, true);
    location.recordServer(10_000, 1, false);
    expect(location.serverIsFaster).toBe(false);
    expect(location.summary).toBe(
      "this page 0.13 million pixels a second, the server 0.14 million pixels a second",
    );
  });

  it("gives complete frames to the page where they are quick, with hysteresis", () => {
    const location = new RenderLocation();
    expect(location.chooseComplete(1000)).toBe(false);
    location.recordPage(1000, 0.2);
    expect(location.chooseComplete(1_000_000)).toBe(true);
    expect(location.chooseComplete(1_400_000)).toBe(true);
    expect(location.chooseComplete(1_600_000)).toBe(false);
    expect(location.chooseComplete(1_400_000)).toBe(false);
    location.recordServer(1000, 1, true);
    expect(location.chooseComplete(1_400_000)).toBe(true);
  });

  it("limits the memory by that of the device", () => {
    expect([undefined, 0.25, 2, 8].map((gib) => memoryLimit(gib) / 2 ** 20)).toEqual([768, 96, 256, 768]);
  });
});

describe("an occupancy", () => {
  it("changes in a part", () => {
    const before = { origin: [0, 0, 0] as Vec3, dims: [2, 3, 4] as Vec3, codes: new Uint16Array(24) };
    const after = replacePart(before, [1, 1, 2], [1, 2, 2], Uint16Array.from([1, 2, 3, 4]));
    expect([...after].flatMap((code, n) => (code ? [[n, code]] : []))).toEqual([
      [18, 1],
      [19, 2],
      [22, 3],
      [23, 4],
    ]);
    expect(before.codes.some((code) => code > 0)).toBe(false);
  });
});

describe("the viewer's camera", () => {
  const start = [1, 0, 0, 0, 0, 0, -1, -4, 0, 1, 0, 1, 0, 0, 0, 1];

  it("turns about the center and keeps its distance, to the pole and no farther", () => {
    const orbit = new Orbit(start, [0, 0, 1], [0, 0, 1]);
    expect(orbit.target).toEqual([0, 0, 1]);
    orbit.turn(Math.PI / 2, 0);
    expect(orbit.eye[0]).toBeCloseTo(-4);
    orbit.turn(0, 10);
    expect(orbit.eye[2]).toBeGreaterThan(4.9);
    expect(Math.hypot(orbit.eye[0], orbit.eye[1], orbit.eye[2] - 1)).toBeCloseTo(4);
    orbit.zoom(0.5);
    expect(Math.hypot(orbit.eye[0], orbit.eye[1], orbit.eye[2] - 1)).toBeCloseTo(2);
  });

  it("shifts by what the picture shows", () => {
    const orbit = new Orbit(start, [0, 0, 1], [0, 0, 1]);
    orbit.shift(0.25, 0, 0.5);
    expect(orbit.target[0]).toBeCloseTo(-1);
    orbit.shift(0, 0.25, 0.5);
    expect(orbit.target[2]).toBeCloseTo(2);
  });

  it("goes along a path, round where it is a loop", () => {
    const other = [...start];
    other[3] = 2;
    const stills = [
      { c2w: start, fov_y_deg: 40 },
      { c2w: other, fov_y_deg: 50 },
    ];
    const path = { stills, seconds: 4, loop: false };
    expect(viewAt(path, 2)).toMatchObject({ fov_y_deg: 45 });
    expect(viewAt(path, 2).c2w[3]).toBeCloseTo(1);
    expect(viewAt(path, 9).c2w[3]).toBeCloseTo(2);
    expect(viewAt({ ...path, loop: true }, 3).c2w[3]).toBeCloseTo(1);
  });
});

it("a lost context, which knows no limits, is no reason to give up", () => {
  const gl = (said: number | null): WebGL2RenderingContext =>
    ({ getParameter: () => said }) as unknown as WebGL2RenderingContext;
  expect(deviceLimit(gl(null), 0)).toBeGreaterThan(4096);
  expect(deviceLimit(gl(2048), 0)).toBe(2048);
});

describe("cages that are no parallelepipeds", () => {
  const { EDIT_ROWS, HEXAHEDRON, HEXAHEDRON_ROWS } = EDIT_LAYOUT;
  /** Rows of one edit: its numbers in w, and which of its two hexahedra are affine. */
  function rows(simple: number, first: number, last: number, affine: [number, number]): Float32Array {
    const out = new Float32Array(4 * EDIT_ROWS);
    out[4 * EDIT_LAYOUT.SIMPLE_SCALAR + 3] = simple;
    out[4 * EDIT_LAYOUT.FIRST_SCALAR + 3] = first;
    out[4 * EDIT_LAYOUT.LAST_SCALAR + 3] = last;
    affine.forEach((value, n) => (out[4 * (HEXAHEDRON + n * HEXAHEDRON_ROWS) + 3] = value));
    return out;
  }
  it("count only where samples go through them", () => {
    expect(isBent(rows(0, 0, 2, [1, 1]), 1)).toBe(false);
    expect(isBent(rows(0, 0, 2, [0, 1]), 1)).toBe(true);
    expect(isBent(rows(0, 0, 2, [1, 0]), 1)).toBe(true);
    expect(isBent(rows(0, 1, 2, [0, 1]), 1)).toBe(false); // no inner cage, as with a lattice cage
    expect(isBent(rows(0, 0, 1, [1, 0]), 1)).toBe(false); // no region: a copy
    expect(isBent(rows(1, 0, 2, [1, 0]), 1)).toBe(false);
    const second = new Float32Array([...rows(1, 0, 2, [1, 1]), ...rows(0, 0, 2, [0, 1])]);
    expect(isBent(second, 2)).toBe(true);
  });
});
