/** Places in textures that layers have, by their keys. */
export class Places {
  private readonly free: number[];
  private readonly taken = new Map<string, Int32Array>();

  /** Places from `first` to before `end`. */
  constructor(first: number, end: number) {
    this.free = Array.from({ length: Math.max(0, end - first) }, (_, n) => end - 1 - n);
  }

  get left(): number {
    return this.free.length;
  }

  of(key: string): Int32Array | null {
    return this.taken.get(key) ?? null;
  }

  /** Frees all but what these keys have. */
  keep(keys: ReadonlySet<string>): void {
    for (const [key, places] of this.taken) {
      if (keys.has(key)) continue;
      this.free.push(...Array.from(places).reverse());
      this.taken.delete(key);
    }
  }

  /** So many places for a key; null, and none taken, where fewer are free. */
  take(key: string, count: number): Int32Array | null {
    if (count > this.free.length) return null;
    const places = Int32Array.from({ length: count }, () => this.free.pop() ?? -1);
    this.taken.set(key, places);
    return places;
  }
}
