"""A virtual machine that runs a stock Debian kernel, with busybox and the programs it is given.

    kernel = fetch_kernel(cache)                  # Unavailable if that cannot be had
    guest = Guest(folder, kernel, [fingertip, "/usr/bin/lsusb"], usbredir=["/tmp/usb.sock"])
    status, output = guest.run("lsusb -v")
    guest.stop()

Software emulation throughout: no KVM, no privileges. Kernel and modules come out of Debian's package, which is
downloaded and never installed.
"""

import base64
import gzip
import lzma
import os
import pathlib
import re
import select
import shutil
import socket
import stat
import subprocess
import tarfile

HERE = pathlib.Path(__file__).resolve().parent
KERNEL_PACKAGE = "linux-image-amd64"
MODULES = ("usb-common", "usbcore", "xhci-hcd", "xhci-pci", "cdc-acm")
QEMU = "qemu-system-x86_64"
BUSYBOX = "/bin/busybox"
# Ends what hangs; nothing is judged by it.
BOOT_LIMIT_s = 600
LIMIT_s = 300


class Unavailable(Exception):
    """What is missing on this machine, and how to get it."""


def call(*command, **options):
    return subprocess.run(command, capture_output=True, **options)


def unpack_vmlinux(image):
    """The kernel inside a bzImage: Documentation/x86/boot.rst, setup_sects, payload_offset, payload_length."""
    at = (image[0x1F1] + 1) * 512 + int.from_bytes(image[0x248:0x24C], "little")
    payload = image[at : at + int.from_bytes(image[0x24C:0x250], "little")]
    if not payload.startswith(b"\xfd7zXZ"):
        raise Unavailable("the kernel package's image is not compressed with xz, as Debian's is")
    return lzma.LZMADecompressor().decompress(payload)


def fetch_kernel(cache):
    """The folder with vmlinux and the modules, made on first use."""
    cache = pathlib.Path(cache)
    folder = cache / "kernel"
    if folder.is_dir():
        return folder
    for tool in ("apt-cache", "apt-get", "dpkg-deb"):
        if not shutil.which(tool):
            raise Unavailable(f"{tool} is not here: the kernel comes from Debian's package {KERNEL_PACKAGE}")
    depends = call("apt-cache", "depends", KERNEL_PACKAGE, text=True).stdout
    package = re.search(r"Depends: (linux-image-\S+)", depends)
    if not package:
        raise Unavailable(f"apt knows no package {KERNEL_PACKAGE}: run apt-get update on a Debian system")
    cache.mkdir(parents=True, exist_ok=True)
    done = call("apt-get", "download", package[1], cwd=cache, text=True)
    archives = sorted(cache.glob(f"{package[1]}_*.deb"))
    if done.returncode or not archives:
        raise Unavailable(f"apt-get download {package[1]}: {(done.stderr.strip().splitlines() or ['failed'])[-1]}")
    fresh = cache / "kernel.new"
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir()
    wanted = {f"{name}.ko" for name in MODULES}
    unpack = subprocess.Popen(["dpkg-deb", "--fsys-tarfile", archives[-1]], stdout=subprocess.PIPE)
    with tarfile.open(fileobj=unpack.stdout, mode="r|") as archive:
        for member in archive:
            name = pathlib.PurePosixPath(member.name).name
            if name.startswith("vmlinuz-"):
                (fresh / "vmlinux").write_bytes(unpack_vmlinux(archive.extractfile(member).read()))
            elif name in wanted:
                (fresh / name).write_bytes(archive.extractfile(member).read())
    unpack.wait()
    missing = [name for name in ("vmlinux", *sorted(wanted)) if not (fresh / name).exists()]
    if missing:
        raise Unavailable(f"{archives[-1].name} holds no {', '.join(missing)}")
    for archive in archives:
        archive.unlink()
    fresh.rename(folder)
    return folder


def check_programs():
    """Unavailable unless the virtual machine can be run here."""
    if not shutil.which(QEMU):
        raise Unavailable(f"{QEMU} is not here: install qemu-system-x86")
    if b"usb-redir" not in call(QEMU, "-device", "help").stdout:
        raise Unavailable(f"this {QEMU} has no usb-redir device: Debian has it in qemu-system-common")
    if not pathlib.Path(BUSYBOX).exists() or b"not a dynamic" not in call("ldd", BUSYBOX).stderr + call("ldd", BUSYBOX).stdout:
        raise Unavailable(f"{BUSYBOX} is missing or needs libraries: install busybox-static")


def libraries(program):
    listing = call("ldd", program, text=True, check=True).stdout
    return [pathlib.Path(path) for path in re.findall(r"(/\S+) \(0x", listing)]


class Cpio:
    """An archive in the format "newc" of the kernel's Documentation/driver-api/early-userspace/buffer-format.rst."""

    def __init__(self):
        self.parts = []
        self.number = 0
        self.folders = set()

    def _entry(self, name, mode, data=b"", device=(0, 0)):
        self.number += 1
        coded = name.encode() + b"\0"
        fields = (self.number, mode, 0, 0, 1, 0, len(data), 0, 0, *device, len(coded), 0)
        head = b"070701" + "".join(f"{field:08x}" for field in fields).encode() + coded
        self.parts += [head, b"\0" * (-len(head) % 4), data, b"\0" * (-len(data) % 4)]

    def folder(self, name):
        if name and name not in self.folders:
            self.folder(name.rpartition("/")[0])
            self.folders.add(name)
            self._entry(name, stat.S_IFDIR | 0o755)

    def file(self, name, data):
        self.folder(name.rpartition("/")[0])
        self._entry(name, stat.S_IFREG | 0o755, data)

    def console(self):
        self.folder("dev")
        self._entry("dev/console", stat.S_IFCHR | 0o600, device=(5, 1))

    def bytes(self):
        self._entry("TRAILER!!!", 0)
        return b"".join(self.parts)


def make_initramfs(path, kernel, programs):
    cpio = Cpio()
    for name in ("proc", "sys", "tmp", "bin"):
        cpio.folder(name)
    cpio.console()
    cpio.file("init", (HERE / "init.sh").read_bytes())
    cpio.file("bin/busybox", pathlib.Path(BUSYBOX).read_bytes())
    for name in MODULES:
        cpio.file(f"modules/{name}.ko", (kernel / f"{name}.ko").read_bytes())
    needed = set()
    for program in programs:
        stripped = path.with_suffix(".stripped")
        subprocess.run(["strip", "-o", stripped, program], check=True)
        cpio.file(f"bin/{pathlib.Path(program).name}", stripped.read_bytes())
        stripped.unlink()
        needed.update(libraries(program))
    for library in sorted(needed):
        cpio.file(str(library).lstrip("/"), library.read_bytes())
    path.write_bytes(gzip.compress(cpio.bytes(), 1))


class Guest:
    def __init__(self, folder, kernel, programs, usbredir):
        self.folder = pathlib.Path(folder)
        initramfs = self.folder / "initramfs.gz"
        make_initramfs(initramfs, pathlib.Path(kernel), programs)
        port = self.folder / "guest.sock"
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(str(port))
        listener.listen()
        self.errors = open(self.folder / "qemu.err", "w+")
        # From no_timer_check on: a machine that is given no time for a second or two is not ill.
        linux = "console=ttyS0 quiet panic=-1 mitigations=off nokaslr no_timer_check tsc=nowatchdog nowatchdog rcupdate.rcu_cpu_stall_suppress=1"
        machine = "-M pc -accel tcg -m 256 -display none -monitor none -no-reboot -nic none -device qemu-xhci".split()
        boot = ["-kernel", kernel / "vmlinux", "-initrd", initramfs, "-append", linux]
        serial = ["-serial", f"file:{self.folder / 'console.log'}", "-serial", f"unix:{port},server=off"]
        for number, path in enumerate(usbredir):
            serial += ["-chardev", f"socket,id=usb{number},path={path},reconnect=1", "-device", f"usb-redir,chardev=usb{number}"]
        silent = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": self.errors}
        self.process = subprocess.Popen([QEMU, *machine, *boot, *serial], **silent)
        self.requests = 0
        self.received = b""
        try:
            with listener:
                self.port = self._accept(listener)
            while self._line(BOOT_LIMIT_s) != "ready":
                pass
        except Exception:
            self.stop()
            raise

    def _accept(self, listener):
        """The machine's serial port, which it connects as it starts; or it has ended."""
        ended = os.pidfd_open(self.process.pid)
        try:
            if listener in select.select([listener, ended], [], [], BOOT_LIMIT_s)[0]:
                return listener.accept()[0]
        finally:
            os.close(ended)
        raise RuntimeError(f"{QEMU} did not start: {(self.folder / 'qemu.err').read_text().strip()}")

    def _receive(self, limit_s):
        self.port.settimeout(limit_s)
        try:
            got = self.port.recv(65536)
        except TimeoutError:
            got = b""
        if not got:
            console = (self.folder / "console.log").read_text(errors="replace")
            raise RuntimeError(f"the virtual machine answers no more; the end of its console:\n{console[-2000:]}")
        self.received += got

    def _line(self, limit_s):
        while b"\n" not in self.received:
            self._receive(limit_s)
        line, _, self.received = self.received.partition(b"\n")
        return line.decode(errors="replace").strip()

    def run_bytes(self, script, limit_s=LIMIT_s):
        """Runs a shell script in the machine; returns its exit status and what it printed."""
        self.requests += 1
        self.port.sendall(f"{self.requests} {base64.b64encode(script.encode()).decode()}\n".encode())
        number, status, length = self._line(limit_s).split()
        if int(number) != self.requests:
            raise RuntimeError(f"answer {number} to request {self.requests}")
        while len(self.received) < int(length):
            self._receive(limit_s)
        output, self.received = self.received[: int(length)], self.received[int(length) :]
        return int(status), output

    def run(self, script, limit_s=LIMIT_s):
        status, output = self.run_bytes(script, limit_s)
        return status, output.decode(errors="replace")

    def read_file(self, path, limit_s=LIMIT_s):
        status, output = self.run_bytes(f"gzip -c {path}", limit_s)
        if status:
            raise RuntimeError(f"{path} cannot be read in the virtual machine")
        return gzip.decompress(output)

    def stop(self):
        """Ends the machine; returns what QEMU complained of, the first time."""
        if self.errors.closed:
            return []
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.errors.seek(0)
        complaints = [line for line in self.errors.read().splitlines() if "terminating on signal 15" not in line]
        self.errors.close()
        return complaints
