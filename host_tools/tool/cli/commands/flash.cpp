#include "libfingertip/clock.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"
#include "libfingertip/uf2.hpp"
#include "tool/advice.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/names_of_values.hpp"
#include "tool/cli/terminal.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mntent.h>
#include <optional>
#include <string_view>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

namespace fingertip {

namespace {

struct FlashOptions {
  Choice choice;
  std::string file;
  std::string volume;
};

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr milliseconds LOOK_INTERVAL{100};
constexpr milliseconds VOLUME_TIMEOUT{10000};
/* A desktop mounts the drive itself within this time, or not at all. */
constexpr milliseconds MOUNTED_BY_OTHERS{3000};
constexpr milliseconds RETURN_TIMEOUT{15000};
/* udev gives a new port its owner within this time, or has no rule for it. */
constexpr milliseconds PERMITTED_WITHIN{3000};
constexpr Session::Policy QUICK = {milliseconds(400), 3};
constexpr const char *INFO_FILE = "INFO_UF2.TXT";
constexpr const char *BY_LABEL = "/dev/disk/by-label/RPI-RP2";
constexpr const char *NO_VOLUME = ": no RP2040 boot volume (no INFO_UF2.TXT); ";
constexpr const char *PRESS = "unplug the Pico, hold its BOOTSEL button while plugging it in, and run this again";

void sleep_or_stop() {
  if (stop_requested()) {
    throw Interrupted();
  }
  wait_until(host_now() + LOOK_INTERVAL);
}

/* The loader's board, from its INFO_UF2.TXT; nothing where there is none. */
std::optional<std::string> loader_board(const std::string &folder) {
  std::ifstream file(folder + "/" + INFO_FILE);
  std::string line;
  while (std::getline(file, line)) {
    constexpr std::string_view key = "Board-ID:";
    if (line.compare(0, key.size(), key) == 0) {
      return std::string(trim(line.substr(key.size())));
    }
  }
  return std::nullopt;
}

/* Mount points of FAT drives that are a loader of the RP2040. */
std::vector<std::string> mounted_volumes() {
  std::vector<std::string> volumes;
  std::FILE *mounts = setmntent("/proc/self/mounts", "r");
  while (const mntent *each = mounts ? getmntent(mounts) : nullptr) {
    if (each->mnt_type == std::string("vfat") && loader_board(each->mnt_dir) == "RPI-RP2") {
      volumes.emplace_back(each->mnt_dir);
    }
  }
  if (mounts) {
    endmntent(mounts);
  }
  return volumes;
}

/* The drive while it is open, unmounted again if it was mounted here. */
class Volume {
public:
  /* Now, or nothing. */
  static std::unique_ptr<Volume> find(const std::string &given, bool may_mount) {
    if (!given.empty()) {
      auto board = loader_board(given);
      if (board && *board != "RPI-RP2") {
        throw Error(given + ": the loader of another chip (" + *board + "); " +
                    (*board == "RP2350" ? "there is no firmware for a Pico 2 yet, take a Pico or a Pico W" : "give that of an RP2040"));
      }
      return board ? std::unique_ptr<Volume>(new Volume(given, false)) : nullptr;
    }
    auto mounted = mounted_volumes();
    if (mounted.size() > 1) {
      throw Error("several Picos wait for firmware; unplug all but one, or choose with --volume: " + mounted[0] + " " + mounted[1]);
    }
    if (mounted.size() == 1) {
      return std::unique_ptr<Volume>(new Volume(mounted[0], false));
    }
    return may_mount && fs::exists(BY_LABEL) ? mount_it() : nullptr;
  }

  ~Volume() {
    if (mounted_here_) {
      umount2(folder_.c_str(), MNT_DETACH);
      rmdir(folder_.c_str());
    }
  }
  Volume(const Volume &) = delete;
  Volume &operator=(const Volume &) = delete;

  /* The chip restarts with the last block, so that what follows it may fail. */
  void write(const FirmwareImage &image) const {
    std::string path = folder_ + "/fingertip.uf2";
    int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd < 0) {
      throw Error(path + ": " + std::strerror(errno) + "; " + PRESS);
    }
    std::size_t done = 0;
    while (done < image.file.size()) {
      ssize_t count = ::write(fd, image.file.data() + done, image.file.size() - done);
      if (count <= 0 && errno != EINTR) {
        int error = errno;
        close(fd);
        throw Error(path + ": " + std::strerror(error) + "; " + PRESS);
      }
      done += static_cast<std::size_t>(std::max<ssize_t>(count, 0));
    }
    fsync(fd);
    close(fd);
  }

private:
  Volume(std::string folder, bool mounted_here) : folder_(std::move(folder)), mounted_here_(mounted_here) {}

  static std::unique_ptr<Volume> mount_it() {
    if (geteuid() == 0) {
      char folder[] = "/run/fingertip-XXXXXX";
      if (!mkdtemp(folder) || mount(BY_LABEL, folder, "vfat", MS_NOSUID | MS_NODEV | MS_NOEXEC, nullptr) != 0) {
        throw Error(std::string(BY_LABEL) + ": cannot mount it (" + std::strerror(errno) + "); mount it, and give its folder as --volume");
      }
      return std::unique_ptr<Volume>(new Volume(folder, true));
    }
    pid_t child = fork();
    if (child == 0) {
      int null = open("/dev/null", O_RDWR);
      dup2(null, STDOUT_FILENO);
      dup2(null, STDERR_FILENO);
      execlp("udisksctl", "udisksctl", "mount", "--no-user-interaction", "-b", BY_LABEL, nullptr);
      _exit(127);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child || status != 0) {
      throw Error("the drive RPI-RP2 is not mounted; sudo mount -o umask=0 " + std::string(BY_LABEL) + " /mnt, then give --volume /mnt");
    }
    auto mounted = mounted_volumes();
    return mounted.empty() ? nullptr : std::unique_ptr<Volume>(new Volume(mounted[0], false));
  }

  std::string folder_;
  bool mounted_here_;
};

/* Asks the fingertip into its loader; its serial number if it reported one. */
std::string ask_into_loader(const FlashOptions &options, const FirmwareImage &image, const Endpoint &endpoint) {
  auto transport = open_endpoint(endpoint);
  Session session(*transport, stop_requested);
  std::string serial = endpoint.serial;
  try {
    wire_info info = session.info(QUICK).body.info;
    if (is_simulated(info)) {
      throw Error("fingertip " + text_field(info.serial) + " is simulated, and takes no firmware; name another with --device");
    }
    if (text_field(info.board) != image.board) {
      throw Error(options.file + ": for board " + image.board + ", but fingertip " + text_field(info.serial) + " is a " +
                  text_field(info.board) + "; give fingertip-" + text_field(info.board) + ".uf2");
    }
    serial = text_field(info.serial);
    session.command(command_loader(), QUICK);
    return serial;
  } catch (const Gone &) {
    return serial; /* on its way */
  } catch (const Error &error) {
    /* one that answered is judged; a mute one, or of another protocol version, understands this */
    if (session.statistics().packets > 0 || !transport->ask_loader()) {
      throw;
    }
    return serial;
  }
}

std::unique_ptr<Volume> wait_for_volume(const std::string &given) {
  auto begin = host_now();
  for (;;) {
    auto waited = host_now() - begin;
    if (auto volume = Volume::find(given, waited > MOUNTED_BY_OTHERS)) {
      return volume;
    }
    if (waited > VOLUME_TIMEOUT) {
      throw Error((given.empty() ? "no drive RPI-RP2 appeared; " : given + NO_VOLUME) + PRESS);
    }
    sleep_or_stop();
  }
}

/* The fingertip as it came back; nothing if it did and may not be opened. */
std::optional<wire_info> wait_for_return(const Choice &choice) {
  Error last("nothing answered");
  auto begin = host_now();
  auto not_refused = begin;
  while (host_now() - begin < RETURN_TIMEOUT) {
    sleep_or_stop();
    try {
      return ask(choose_endpoint(choice), stop_requested);
    } catch (const Error &error) {
      last = error;
    }
    if (last.code() != ErrorCode::permission_denied) {
      not_refused = host_now();
    } else if (host_now() - not_refused > PERMITTED_WITHIN) {
      std::fprintf(stderr, "written, and it came back; its version was not read: %s\n", error_text(last).c_str());
      return std::nullopt;
    }
  }
  throw Error("written, but it did not come back (" + std::string(last.what()) + "); " + PRESS);
}

int flash(const FlashOptions &options) {
  FirmwareImage image = read_firmware(options.file);
  Choice choice = options.choice;
  std::unique_ptr<Volume> volume;
  /* What has other things in it will not become a mount point. */
  std::error_code unreadable;
  if (!options.volume.empty() && fs::exists(options.volume, unreadable) && !fs::is_empty(options.volume, unreadable) &&
      !loader_board(options.volume)) {
    throw Error(options.volume + NO_VOLUME + "leave out --volume, or give that of the drive RPI-RP2");
  }
  if (choice.device.empty() && choice.port.empty()) {
    volume = Volume::find(options.volume, true);
  }
  if (!volume) {
    std::optional<Endpoint> endpoint;
    try {
      endpoint = choose_endpoint(choice);
    } catch (const Error &error) {
      throw Error(error_text(error) + "; or " + PRESS);
    }
    std::string serial = ask_into_loader(options, image, *endpoint);
    if (choice.port.empty() && !serial.empty()) {
      choice.device = serial;
    }
    volume = wait_for_volume(options.volume);
  }
  std::fprintf(stderr, "writing %s %s for %s\n", image.version.c_str(), image.git_hash.c_str(), image.board.c_str());
  volume->write(image);
  volume.reset();
  std::optional<wire_info> back = wait_for_return(choice);
  if (!back) {
    return 0;
  }
  const wire_info &info = *back;
  const std::string version = value_of(info_metadata(info), "firmware");
  if (version != image.version || text_field(info.git_hash) != image.git_hash.substr(0, WIRE_TEXT_BYTES) ||
      text_field(info.board) != image.board) {
    throw Error("written, but fingertip " + text_field(info.serial) + " came back with firmware " + version + " " +
                text_field(info.git_hash) + " instead of " + image.version + " " + image.git_hash + "; " + PRESS);
  }
  std::printf("fingertip %s: firmware %s %s, board %s\n", printable(text_field(info.serial)).c_str(), version.c_str(),
              text_field(info.git_hash).c_str(), text_field(info.board).c_str());
  return 0;
}

} // namespace

void add_flash(CommandLine &line) {
  auto options = std::make_shared<FlashOptions>();
  CLI::App *command = line.add("flash", "Install firmware and see it come back", [options] { return flash(*options); });
  with_port(command, options->choice);
  with_value(command, "IMAGE.uf2", "image", options->file, "The firmware, build/BOARD/fingertip-BOARD.uf2")->required();
  with_value(command, "FOLDER", "--volume", options->volume, "Where the loader's drive RPI-RP2 is mounted; default: found, or mounted");
}

} // namespace fingertip
