/**
 * Edges of clk_sys, counted since power-on: what happens "in a cycle" happens at the edge that ends it. The count
 * goes on through changes of frequency.
 */
export class SysClock {
  constructor(time, hz) {
    this.time = time;
    this.origin_ns = time.nanos;
    this.origin_edge = 0;
    this.period_ns = 1e9 / hz;
  }

  retune(hz) {
    const edge = this.edge;
    this.origin_ns = this.ns(edge);
    this.origin_edge = edge;
    this.period_ns = 1e9 / hz;
  }

  /** The last edge that has passed. */
  get edge() {
    return this.origin_edge + Math.floor((this.time.nanos - this.origin_ns) / this.period_ns + 1e-6);
  }

  ns(edge) {
    return this.origin_ns + (edge - this.origin_edge) * this.period_ns;
  }

  /** A time when everything at the edge is complete. */
  afterEdge_ns(edge) {
    return this.ns(edge) + this.period_ns / 4;
  }
}
