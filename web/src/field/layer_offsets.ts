/** Allocation of brick positions in textures to layers, by the keys of the layers. */
export class OffsetAllocator {
  private readonly free: number[];
  private readonly allocated = new Map<string, Int32Array>();

  /** Manages the positions from `first` to before `end`. */
  constructor(first: number, end: number) {
    this.free = Array.from({ length: Math.max(0, end - first) }, (_, n) => end - 1 - n);
  }

  get left(): number {
    return this.free.length;
  }

  get(key: string): Int32Array | null {
    return this.allocated.get(key) ?? null;
  }

  /** Frees all positions except those of these keys. */
  retain(keys: ReadonlySet<string>): void {
    for (const [key, places] of this.allocated) {
      if (keys.has(key)) continue;
      this.free.push(...Array.from(places).reverse());
      this.allocated.delete(key);
    }
  }

  /** Allocates `count` positions to a key; null, without an allocation, if fewer are free. */
  allocate(key: string, count: number): Int32Array | null {
    if (count > this.free.length) return null;
    const places = Int32Array.from({ length: count }, () => this.free.pop() ?? -1);
    this.allocated.set(key, places);
    return places;
  }
}
