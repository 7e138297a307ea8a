/**
 * What silicon and odd hosts do to a release image, each as one figure: the tests hold it to what it must be, and
 * figures.mjs prints it for the report.
 */
import { ImageBench } from './image_bench.mjs';

export class Storms {
  /** images: the folder with those of all boards; tools: see ImageBench. */
  constructor(images, tools) {
    this.images = images;
    this.tools = tools;
  }

  bench(board, options) {
    return new ImageBench(this.images, this.tools, board, options);
  }

  /** How often the device detaches itself from a host that resets it twice before it asks for anything: at the first connection, after a reboot of the host, and plugged in again. */
  ehciDetaches(board, revision) {
    const bench = this.bench(board, { companion: true, fastEnumeration: false, revision });
    const { host } = bench.machine;
    bench.stream(1000);
    let addressed = false;
    host.resetDevice(() => {
      addressed = true;
    });
    bench.until(() => addressed, 1000, 'address');
    bench.run(1000);
    host.unplug();
    bench.run(300);
    host.plug();
    bench.stream(1000);
    bench.assertStreams(100);
    return bench.end().usb.detaches;
  }

  /** How often the watchdog bites, or the device detaches itself, while the host holds the bus low for so long. */
  se0Bites(board, revision, held_ms) {
    const bench = this.bench(board, { revision });
    bench.stream();
    let addressed = false;
    bench.machine.host.holdReset(held_ms * 1e6, () => {
      addressed = true;
    });
    bench.run(held_ms + 200);
    const { reboots, usb } = bench.end();
    return reboots + usb.detaches + (addressed ? 0 : 1);
  }
}
