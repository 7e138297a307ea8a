/**
 * A strict full-speed USB host in emulated time, behaving as Linux does with a UHCI controller.
 *
 * It waits for the pull-up, debounces 100 ms, resets twice around DEVICE(64), addresses the device and reads
 * DEVICE(18), QUALIFIER (must stall), CONFIG(9), CONFIG(all) and strings 0, 2, 1, 3, then SET_CONFIGURATION 1
 * and calls `onConfigured(device)`. After that a client (CDC here, a bridge elsewhere) uses the pipes:
 *
 *     host.control(setup8, dataOut | null, (status, data) => ...)
 *     host.bulkIn(endpoint, length, (status, data) => ...)      done on a short packet or when full
 *     host.bulkOut(endpoint, data, (status) => ...)
 *     host.pollInterrupt(endpoint, interval_ms, (data) => ...)  /  host.stopInterrupt(endpoint)
 *     host.pause(endpoint, on)                                  send it no token for a while; its transfers wait
 *     host.cancel(transfer)      host.unplug()      host.plug()
 *     host.suspend()  /  host.resume()                          the bus idles; transfers wait
 *     host.resetDevice(() => ...)                               transfers are cancelled; the device has an address again
 *     host.holdReset(for_ns)                                    the bus is low for this time; then as in resetDevice
 *     host.restartToggles(addresses)                            after SET_CONFIGURATION, SET_INTERFACE, CLEAR_FEATURE(HALT)
 *
 * With `companion` it is an EHCI controller, whose ports a companion serves at full speed: at each connection and each
 * resetDevice it resets the port, finds no high-speed device, sends no frame and asks for nothing, and hands the port over.
 * The companion debounces and resets it again (Linux, ehci-hub.c check_reset_complete()).
 *
 * Status is 'ok', 'stall', 'cancelled' or 'gone'. One transaction is on the bus at a time and takes its time:
 * (payload + 13 bytes) at 12 Mbit/s, so at most 19 packets of 64 bytes in a frame. A NAKed bulk or control
 * transaction is retried every 10 us; the retries that would be NAKed again are counted, not simulated.
 * A missing answer, a wrong data PID or a malformed descriptor fails the run. So does not a device whose controller is
 * hung by a fault: the hub shuts its port, and it is reset and asked again a few times, then left alone until it detaches.
 */
const BYTE_NS = 8e3 / 12;
const OVERHEAD_BYTES = 13;
const HANDSHAKE_ONLY_NS = 8e3;
const RETRY_NS = 10e3;
const FRAME_NS = 1e6;
const SOF_NS = 3e3;
/** Sync, PID, address, endpoint, CRC and end of a token: the controller answers it with what it has then. */
const TOKEN_NS = 35e3 / 12;
const CONTROL_TIMEOUT_NS = 5e9;
const IDLE_SUSPENDS_NS = 3e6;
/** USB 2.0, 7.1.7.7: resume signalling lasts 20 ms, and the device has 10 ms to recover. */
const RESUME_NS = 20e6;
const RESUME_RECOVERY_NS = 10e6;
const ADDRESS = 5;
/** Linux tries to enumerate a port so often; between two tries it waits. */
const TRIES = 6;
const TRY_AGAIN_NS = 100e6;

const REALISTIC = { debounce_ns: 100e6, reset_ns: 50e6, recovery_ns: 10e6, address_ns: 10e6 };
const FAST = { debounce_ns: 1e6, reset_ns: 10e6, recovery_ns: 1e6, address_ns: 2e6 };

export const setupPacket = (requestType, request, value, index, length) =>
  Uint8Array.of(requestType, request, value & 0xff, value >> 8, index & 0xff, index >> 8, length & 0xff, length >> 8);

class Pipe {
  constructor(endpoint, isIn, maxPacket) {
    this.endpoint = endpoint;
    this.isIn = isIn;
    this.maxPacket = maxPacket;
    this.toggle = 0;
    this.queue = [];
    this.parked_ns = null;
    this.paused = false;
    this.retry_ns = 0;
  }

  get name() {
    return `EP${this.endpoint} ${this.isIn ? 'IN' : 'OUT'}`;
  }
}

export class UsbHost {
  /**
   * @param options scope: of SimulatedTime; report: Report; fast: shorten the waits of enumeration; companion: see above;
   *   onPacket({ t_ns, endpoint, isIn, setup, data, offered_ns }): every acknowledged packet, and when the firmware gave
   *   it to the controller if it is an IN
   */
  constructor({ scope, report, fast = false, companion = false, onPacket = () => {} }) {
    this.scope = scope;
    this.companion = companion;
    this.report = report;
    this.wait = fast ? FAST : REALISTIC;
    this.onPacket = onPacket;
    this.offered_ns = new Map();
    this.onConfigured = () => {};
    this.onDisconnected = () => {};
    const packets = { in_bytes: 0, out_bytes: 0, in_packets: 0, out_packets: 0, naks: 0, stalls: 0 };
    this.statistics = { ...packets, resets: 0, enumerations: 0, detaches: 0 };
    this.block = null;
    this.plugged = true;
    this.frame = 0;
    this.portAlarm = scope.createAlarm(() => this.portStep());
    this.sofAlarm = scope.createAlarm(() => this.#sof());
    this.busAlarm = scope.createAlarm(() => this.#transactionEnd());
    this.retryAlarm = scope.createAlarm(() => this.#schedule());
    this.controlAlarm = scope.createAlarm(() => this.#controlTimeout());
    this.suspendAlarm = scope.createAlarm(() => this.block?.suspend());
    this.pullupAlarm = scope.createAlarm(() => this.#checkPullup());
    this.#detach();
  }

  /** Put this device controller on the other end of the cable. */
  connect(block) {
    this.#gone();
    this.block = block;
    block.onPortChange = () => this.#portChange();
    block.onArmed = (endpoint, isIn) => this.#armed(endpoint, isIn);
    this.#portChange();
  }

  /** The device controller has no power. */
  disconnect() {
    this.#gone();
    if (!this.block) return;
    this.block.onPortChange = () => {};
    this.block.onArmed = () => {};
    this.block = null;
  }

  unplug() {
    this.plugged = false;
    this.suspendAlarm.schedule(IDLE_SUSPENDS_NS);
    this.#portChange();
  }

  plug() {
    this.plugged = true;
    this.suspendAlarm.cancel();
    this.#portChange();
  }

  /** No frame begins any more; after 3 ms of silence the device must see that it is suspended. */
  suspend() {
    if (this.state !== 'active' || !this.device) throw new Error('only a configured device is suspended');
    this.state = 'suspended';
    this.sofAlarm.cancel();
    this.suspendAlarm.schedule(IDLE_SUSPENDS_NS);
  }

  resume() {
    if (this.state !== 'suspended') throw new Error('the bus is not suspended');
    this.suspendAlarm.cancel();
    this.block.resume();
    this.#enumeration = this.#awake();
    this.portStep();
  }

  *#awake() {
    this.state = 'resuming';
    yield RESUME_NS;
    this.sofAlarm.schedule(0);
    yield RESUME_RECOVERY_NS;
    this.state = 'active';
    this.#schedule();
  }

  resetDevice(done) {
    this.holdReset(undefined, done);
  }

  holdReset(for_ns, done = () => {}) {
    this.#abandon();
    this.#enumeration = this.#readdress(done, for_ns);
    this.portStep();
  }

  /** All transfers are cancelled, and the toggles are as after a reset. */
  #abandon() {
    for (const a of [this.portAlarm, this.sofAlarm, this.busAlarm, this.retryAlarm, this.controlAlarm, this.suspendAlarm]) a.cancel();
    const transfers = [this.controlPipe, ...this.pipes.values()].flatMap((p) => p.queue.splice(0));
    this.running = null;
    this.interrupts.clear();
    for (const pipe of [this.controlPipe, ...this.pipes.values()]) {
      pipe.toggle = 0;
      pipe.parked_ns = null;
      pipe.retry_ns = 0;
    }
    for (const t of transfers) t.done('cancelled', Buffer.concat(t.got ?? []));
  }

  *#readdress(done, reset_ns) {
    if (this.companion) yield* this.#handOver();
    yield* this.#resetBus(reset_ns);
    yield* this.#setAddress();
    done();
  }

  restartToggles(addresses = [...this.pipes.keys()]) {
    for (const address of addresses) this.#pipe(address).toggle = 0;
  }

  isBulkIn(endpoint) {
    return this.device?.endpoints.some((e) => e.type === 2 && e.address === (endpoint | 0x80)) ?? false;
  }

  /** A bulk IN packet lies ready and no transfer asks for it. */
  get hasUnasked() {
    return (
      this.state === 'active' &&
      [...this.pipes.values()].some((p) => p.isIn && !p.queue.length && this.isBulkIn(p.endpoint) && this.block.offers(p.endpoint))
    );
  }

  get configured() {
    return this.device !== null;
  }

  // Port and enumeration

  #detach() {
    this.state = 'detached';
    this.address = 0;
    this.device = null;
    this.running = null;
    this.pipes = new Map();
    this.interrupts = new Map();
    this.turn = 0;
    this.controlPipe = new Pipe(0, true, 64);
  }

  #gone() {
    for (const a of [this.portAlarm, this.sofAlarm, this.busAlarm, this.retryAlarm, this.controlAlarm]) a.cancel();
    const transfers = [...this.controlPipe.queue, ...[...this.pipes.values()].flatMap((p) => p.queue)];
    const had = this.device !== null;
    this.#enumeration = null;
    if (this.running) this.block.endTransaction();
    this.#detach();
    for (const t of transfers) t.done('gone', Buffer.alloc(0));
    if (had) this.onDisconnected();
  }

  #portChange() {
    const attached = this.plugged && this.block?.attached;
    if (attached && this.state === 'detached') {
      this.state = 'debounce';
      this.#enumeration = this.#enumerate();
      this.portAlarm.schedule(this.wait.debounce_ns);
      this.suspendAlarm.schedule(IDLE_SUSPENDS_NS);
    } else if (!attached && this.state !== 'detached') {
      if (this.plugged) this.statistics.detaches += 1;
      this.#gone();
    }
    if (this.block && this.block.sieCtrl & (1 << 16) && !this.block.attached) this.pullupAlarm.schedule(5e6);
  }

  #checkPullup() {
    const { block } = this;
    if (block && block.sieCtrl & (1 << 16) && !block.attached)
      this.#fail(`the firmware enabled the pull-up but ${block.attachProblem ?? 'holds USBCTRL in reset'}`);
  }

  #enumeration = null;

  portStep(result) {
    const step = this.#enumeration?.next(result) ?? { done: true };
    if (!step.done && typeof step.value === 'number') this.portAlarm.schedule(step.value);
  }

  #fail(message) {
    this.block.rp2040.fail('usb host', message);
  }

  #unanswered(message) {
    if (!this.block.hung) this.#fail(message);
    this.#gone();
    this.#enumeration = this.#tryAgain();
    this.portStep();
  }

  *#tryAgain() {
    for (let left = TRIES; left > 0; left--) {
      yield* this.#resetBus();
      if (this.block.setup(0, setupPacket(0x80, 6, 1 << 8, 0, 64))) this.#fail('a device that was hung answers without having detached');
      yield TRY_AGAIN_NS;
    }
  }

  *#resetBus(reset_ns) {
    yield* this.#resetPort(reset_ns);
    this.state = 'active';
    this.sofAlarm.schedule(0);
    yield this.wait.recovery_ns;
  }

  *#resetPort(reset_ns = this.wait.reset_ns) {
    this.state = 'reset';
    this.address = 0;
    this.sofAlarm.cancel();
    this.suspendAlarm.cancel();
    this.block.busReset();
    this.statistics.resets += 1;
    yield reset_ns;
    this.block.busResetEnded();
  }

  *#handOver() {
    yield* this.#resetPort();
    this.suspendAlarm.schedule(IDLE_SUSPENDS_NS);
    yield this.wait.debounce_ns;
  }

  /** One control transfer from within the enumeration; `expectStall` makes anything but a stall a failure. */
  *#request(name, packet, { expectStall = false, data = null } = {}) {
    this.control(packet, data, (status, answer) => this.portStep({ status, answer }));
    const { status, answer } = yield null;
    if (expectStall ? status !== 'stall' : status !== 'ok')
      this.#fail(`${name}: ${status}, expected ${expectStall ? 'a stall' : 'an answer'}`);
    return answer;
  }

  *#setAddress() {
    yield* this.#request('SET_ADDRESS', setupPacket(0, 5, ADDRESS, 0, 0));
    yield this.wait.address_ns;
    this.address = ADDRESS;
  }

  *#enumerate() {
    const get = (type, index, length, language = 0) => setupPacket(0x80, 6, (type << 8) | index, language, length);
    if (this.companion) yield* this.#handOver();
    yield* this.#resetBus();
    const first = yield* this.#request('DEVICE(64)', get(1, 0, 64));
    if (first.length < 8 || first[1] !== 1) this.#fail(`DEVICE(64) answered ${first.length} bytes that are no device descriptor`);
    if (first[7] !== 64) this.#fail(`bMaxPacketSize0 is ${first[7]}; only 64 is modelled`);
    yield* this.#resetBus();
    yield* this.#setAddress();
    const device = yield* this.#request('DEVICE(18)', get(1, 0, 18));
    if (device.length !== 18 || device[0] !== 18) this.#fail(`DEVICE(18) answered ${device.length} bytes`);
    yield* this.#request('DEVICE_QUALIFIER', get(6, 0, 10), { expectStall: true });
    const head = yield* this.#request('CONFIG(9)', get(2, 0, 9));
    if (head.length !== 9) this.#fail(`CONFIG(9) answered ${head.length} bytes`);
    const total = head[2] | (head[3] << 8);
    const configuration = yield* this.#request('CONFIG(all)', get(2, 0, total));
    if (configuration.length !== total) this.#fail(`CONFIG(${total}) answered ${configuration.length} bytes`);
    const languages = yield* this.#request('STRING 0', get(3, 0, 255));
    const language = languages[2] | (languages[3] << 8);
    const strings = {};
    for (const [key, at] of [
      ['product', 15],
      ['manufacturer', 14],
      ['serial', 16],
    ]) {
      const index = device[at];
      if (!index) continue;
      const text = yield* this.#request(`STRING ${index}`, get(3, index, 255, language));
      if (text[0] !== text.length || text[1] !== 3) this.#fail(`STRING ${index} has a wrong length or type`);
      strings[key] = new TextDecoder('utf-16le').decode(text.subarray(2));
    }
    yield* this.#request('SET_CONFIGURATION', setupPacket(0, 9, configuration[5], 0, 0));
    const described = {
      device,
      configuration,
      strings,
      vendor: device[8] | (device[9] << 8),
      product: device[10] | (device[11] << 8),
      ...this.#parse(configuration),
    };
    this.statistics.enumerations += 1;
    this.device = described;
    this.onConfigured(described);
  }

  #parse(configuration) {
    const interfaces = [];
    const endpoints = [];
    for (let at = 0; at < configuration.length; at += configuration[at]) {
      const length = configuration[at];
      if (length < 2 || at + length > configuration.length) this.#fail(`configuration descriptor broken at byte ${at}`);
      const d = configuration.subarray(at, at + length);
      if (d[1] === 4) interfaces.push({ number: d[2], class: d[5], subclass: d[6], protocol: d[7] });
      else if (d[1] === 5) {
        const endpoint = {
          address: d[2],
          type: d[3] & 3,
          maxPacket: d[4] | (d[5] << 8),
          interval: d[6],
          interface: interfaces.at(-1)?.number,
        };
        endpoints.push(endpoint);
        this.pipes.set(d[2], new Pipe(d[2] & 15, (d[2] & 0x80) !== 0, endpoint.maxPacket));
      }
    }
    return { interfaces, endpoints };
  }

  // Transfers

  control(packet, data, done) {
    const length = packet[6] | (packet[7] << 8);
    const isIn = (packet[0] & 0x80) !== 0;
    const progress = { stage: 'setup', at: 0, got: [], started_ns: null };
    return this.#submit({ pipe: this.controlPipe, packet, isIn, length, data: data ?? new Uint8Array(0), done, ...progress });
  }

  bulkIn(address, length, done) {
    return this.#submit({ pipe: this.#pipe(address | 0x80), length, got: [], done });
  }

  bulkOut(address, data, done) {
    return this.#submit({ pipe: this.#pipe(address & 0x7f), data, at: 0, done });
  }

  pollInterrupt(address, interval_ms, onData) {
    this.interrupts.set(address, { pipe: this.#pipe(address), interval_ms, due: this.frame + 1, onData });
  }

  stopInterrupt(address) {
    this.interrupts.delete(address);
  }

  pause(address, on) {
    this.#pipe(address).paused = on;
    this.#schedule();
  }

  cancel(transfer) {
    const { queue } = transfer.pipe;
    const index = queue.indexOf(transfer);
    if (index < 0) return;
    queue.splice(index, 1);
    if (transfer.pipe === this.controlPipe && index === 0) this.controlAlarm.cancel();
    transfer.done('cancelled', Buffer.concat(transfer.got ?? []));
  }

  #pipe(address) {
    const pipe = this.pipes.get(address);
    if (!pipe) throw new Error(`the device has no endpoint 0x${address.toString(16)}`);
    return pipe;
  }

  #submit(transfer) {
    transfer.pipe.queue.push(transfer);
    this.#schedule();
    return transfer;
  }

  #controlTimeout() {
    const transfer = this.controlPipe.queue[0];
    if (transfer) this.#fail(`control request ${hex(transfer.packet)} not finished within 5 s (NAKed in its ${transfer.stage} stage)`);
  }

  // Bus schedule

  #sof() {
    this.frame += 1;
    this.block.sof(this.frame);
    const start_ns = this.sofAlarm.at_ns;
    this.sofAlarm.scheduleAt(start_ns + FRAME_NS);
    this.frameEnd_ns = start_ns + FRAME_NS;
    this.bus_free_ns = start_ns + SOF_NS;
    this.#schedule();
  }

  #armed(endpoint, isIn) {
    if (isIn) this.offered_ns.set(endpoint, this.scope.nanos);
    const now = this.scope.nanos;
    for (const pipe of endpoint === 0 ? [this.controlPipe] : [this.pipes.get(isIn ? endpoint | 0x80 : endpoint)]) {
      if (!pipe) continue;
      if (this.running?.pipe === pipe) this.running.armedMeanwhile = true;
      if (pipe.parked_ns === null) continue;
      const retries = Math.max(1, Math.ceil((now - pipe.parked_ns) / RETRY_NS));
      this.statistics.naks += retries - 1;
      pipe.retry_ns = pipe.parked_ns + retries * RETRY_NS;
      pipe.parked_ns = null;
    }
    this.#schedule();
  }

  #candidates() {
    const pipes = [this.controlPipe, ...this.pipes.values()];
    return [...pipes.slice(this.turn % pipes.length), ...pipes.slice(0, this.turn % pipes.length)].filter(
      (p) => p.queue.length && p.parked_ns === null && !p.paused,
    );
  }

  #schedule() {
    if (this.state !== 'active' || this.running) return;
    const now = this.scope.nanos;
    const due = [...this.interrupts.values()].find((i) => i.due <= this.frame);
    let transaction = null;
    if (due) {
      due.due = this.frame + due.interval_ms;
      transaction = { pipe: due.pipe, interrupt: due };
    } else {
      const candidates = this.#candidates();
      if (!candidates.length) return;
      const ready = candidates.find((p) => p.retry_ns <= now);
      if (!ready) {
        this.retryAlarm.scheduleAt(Math.min(...candidates.map((p) => p.retry_ns)));
        return;
      }
      transaction = { pipe: ready, transfer: ready.queue[0] };
    }
    const worst_ns = (transaction.pipe.maxPacket + OVERHEAD_BYTES) * BYTE_NS;
    const start_ns = Math.max(now, this.bus_free_ns ?? now);
    if (start_ns + worst_ns > this.frameEnd_ns) {
      if (due) due.due = this.frame;
      return;
    }
    if (start_ns > now) {
      if (due) due.due = this.frame;
      this.retryAlarm.scheduleAt(start_ns);
      return;
    }
    this.turn += 1;
    this.running = transaction;
    this.#transactionStart(transaction);
  }

  #transactionStart(t) {
    const { pipe, transfer } = t;
    let payload = 0;
    t.kind = 'out';
    if (t.interrupt) t.kind = 'in';
    else if (pipe === this.controlPipe) {
      if (transfer.started_ns === null) {
        transfer.started_ns = this.scope.nanos;
        this.controlAlarm.schedule(CONTROL_TIMEOUT_NS);
      }
      if (transfer.stage === 'setup') t.kind = 'setup';
      else if (transfer.stage === 'data') t.kind = transfer.isIn ? 'in' : 'out';
      else t.kind = transfer.isIn && transfer.length ? 'out' : 'in';
    } else if (pipe.isIn) t.kind = 'in';

    if (t.kind === 'setup') payload = 8;
    else if (t.kind === 'in') {
      t.answer = this.block.inToken(this.address, pipe.endpoint);
      payload = t.answer.answer === 'data' ? t.answer.data.length : -1;
    } else {
      t.data = transfer.stage === 'status' ? new Uint8Array(0) : transfer.data.subarray(transfer.at, transfer.at + pipe.maxPacket);
      payload = t.data.length;
    }
    this.busAlarm.schedule(payload < 0 ? HANDSHAKE_ONLY_NS : (payload + OVERHEAD_BYTES) * BYTE_NS);
  }

  #transactionEnd() {
    const t = this.running;
    this.running = null;
    const { pipe, transfer } = t;
    this.bus_free_ns = this.scope.nanos;
    if (transfer && pipe.queue[0] !== transfer) {
      // Cancelled while on the bus: an IN packet already sent is acknowledged and lost, as on a real host.
      if (t.kind === 'in' && t.answer.answer === 'data') {
        t.answer.acknowledged();
        pipe.toggle ^= 1;
      }
    } else if (t.kind === 'setup') this.#setupDone(t);
    else if (t.kind === 'in') this.#inDone(t);
    else this.#outDone(t);
    this.#schedule();
  }

  #setupDone({ pipe, transfer }) {
    if (!this.block.setup(this.address, transfer.packet)) {
      this.#unanswered(`no answer to SETUP ${hex(transfer.packet)} at address ${this.address}`);
      return;
    }
    this.onPacket({ t_ns: this.scope.nanos, endpoint: 0, isIn: false, setup: true, data: transfer.packet });
    pipe.toggle = 1;
    transfer.stage = transfer.length ? 'data' : 'status';
    this.bus_free_ns += TOKEN_NS;
  }

  #refused({ pipe, transfer, armedMeanwhile }, answer) {
    if (answer === 'none') {
      this.#unanswered(`no answer from ${pipe.name} at address ${this.address}; is the endpoint enabled?`);
      return;
    }
    if (answer === 'nak') {
      this.statistics.naks += 1;
      if (armedMeanwhile) pipe.retry_ns = this.scope.nanos + RETRY_NS;
      else pipe.parked_ns = this.scope.nanos;
      return;
    }
    this.statistics.stalls += 1;
    this.#finish(pipe, transfer, 'stall');
  }

  #inDone(t) {
    const { pipe, transfer, interrupt, answer } = t;
    if (interrupt) {
      if (answer.answer === 'nak') this.statistics.naks += 1;
      else if (answer.answer === 'none') this.#unanswered(`no answer from interrupt ${pipe.name}; is the endpoint enabled?`);
      if (answer.answer !== 'data') return;
    } else if (answer.answer !== 'data') {
      this.#refused(t, answer.answer);
      return;
    }
    const status = transfer?.stage === 'status';
    const expected = status ? 1 : pipe.toggle;
    if (answer.pid !== expected) this.#fail(`${pipe.name}: the device sent DATA${answer.pid}, expected DATA${expected}`);
    const { data } = answer;
    if (data.length > pipe.maxPacket) this.#fail(`${pipe.name}: packet of ${data.length} bytes, wMaxPacketSize is ${pipe.maxPacket}`);
    answer.acknowledged();
    pipe.toggle ^= 1;
    this.statistics.in_packets += 1;
    if (pipe.endpoint) this.statistics.in_bytes += data.length;
    const { endpoint } = pipe;
    this.onPacket({ t_ns: this.scope.nanos, endpoint, isIn: true, setup: false, data, offered_ns: this.offered_ns.get(endpoint) });
    if (interrupt) {
      interrupt.onData(data);
      return;
    }
    if (status) {
      if (data.length) this.#fail(`status stage of ${hex(transfer.packet)} carried ${data.length} bytes`);
      this.#finish(pipe, transfer, 'ok');
      return;
    }
    transfer.got.push(data);
    const total = transfer.got.reduce((n, d) => n + d.length, 0);
    if (total > transfer.length) this.#fail(`${pipe.name}: ${total} bytes where ${transfer.length} were asked for`);
    if (data.length < pipe.maxPacket || total === transfer.length) this.#dataDone(pipe, transfer);
  }

  #dataDone(pipe, transfer) {
    if (pipe === this.controlPipe) transfer.stage = 'status';
    else this.#finish(pipe, transfer, 'ok');
  }

  #outDone(t) {
    const { pipe, transfer, data } = t;
    const status = transfer.stage === 'status';
    const answer = this.block.outData(this.address, pipe.endpoint, status ? 1 : pipe.toggle, data);
    if (answer !== 'ack') {
      this.#refused(t, answer);
      return;
    }
    pipe.toggle ^= 1;
    this.statistics.out_packets += 1;
    if (pipe.endpoint) this.statistics.out_bytes += data.length;
    this.onPacket({ t_ns: this.scope.nanos, endpoint: pipe.endpoint, isIn: false, setup: false, data });
    if (status) {
      this.#finish(pipe, transfer, 'ok');
      return;
    }
    transfer.at += data.length;
    if (transfer.at >= transfer.data.length) this.#dataDone(pipe, transfer);
  }

  #finish(pipe, transfer, status) {
    if (pipe === this.controlPipe) this.controlAlarm.cancel();
    pipe.queue.shift();
    transfer.done(status, Buffer.concat(transfer.got ?? []));
  }
}

const hex = (bytes) => Buffer.from(bytes).toString('hex');
