#include "libfingertip/connection.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/serial_transport.hpp"
#include "libfingertip/share_socket.hpp"
#include "libfingertip/text.hpp"
#include "libfingertip/usb_transport.hpp"

#include <algorithm>
#include <filesystem>

namespace fingertip {

constexpr Session::Policy QUICK = {std::chrono::milliseconds(400), 3};

static const Found *with_serial(const std::vector<Found> &found, const std::string &serial) {
  return find_in(found, [&](const Found &each) { return is_same_serial(each.serial, serial); });
}

/* Of the fingertip there. */
static std::string serial_of(const Way &way, const std::string &root) {
  return text_field(ask(
                        way, [] { return false; }, root)
                        .serial);
}

/* Throws Error where there is none. */
static Way sure_way_to(const Found &found, Reach reach) {
  if (auto way = way_to(found, reach)) {
    return *way;
  }
  if (reach == Reach::socket) {
    throw Error(ErrorCode::not_shared, (found.serial.empty() ? found.port : found.serial) + ": no program shares it");
  }
  throw Error(ErrorCode::no_driver, found.serial + ": has no serial port: its driver cdc_acm is not "
                                                   "loaded, or another program uses it by libusb");
}

/* Its serial number, or its port if that is unknown. */
static std::string name_of(const Found &found, Reach reach, const std::string &root) {
  if (!found.serial.empty()) {
    return found.serial;
  }
  try {
    if (auto way = way_to(found, reach)) {
      return serial_of(*way, root) + " (" + found.port + ")";
    }
  } catch (const Error &) {
    /* the port has to do */
  }
  return found.port;
}

static Way only_one(const std::vector<Found> &found, Reach reach, const std::string &root, const std::string &none) {
  if (found.empty()) {
    const std::string boot_rom = find_boot_rom(root);
    throw Error(ErrorCode::no_fingertip, none + (boot_rom.empty() ? "" : ", but " + boot_rom));
  }
  if (found.size() > 1) {
    throw Error(ErrorCode::several_fingertips,
                "several fingertips found: " + joined(found, ", ", [&](const Found &each) { return name_of(each, reach, root); }));
  }
  return sure_way_to(found[0], reach);
}

static Way with_wanted_serial(const Choice &choice, const std::string &root) {
  Finds finds = find_fingertips(root);
  if (const Found *found = with_serial(finds.here, choice.device)) {
    return sure_way_to(*found, choice.reach);
  }
  std::string others;
  std::string unasked;
  for (const Found &found : finds.here) {
    others += " " + found.serial;
  }
  for (const Found &found : finds.in_environment) {
    auto way = way_to(found, choice.reach);
    if (!way) {
      continue;
    }
    try {
      way->serial = serial_of(*way, root);
    } catch (const Error &error) {
      unasked = std::string(error.what());
      continue;
    }
    if (is_same_serial(way->serial, choice.device)) {
      return *way;
    }
    others += " " + way->serial;
  }
  throw Error(ErrorCode::no_such_fingertip, "no fingertip " + choice.device + " here" +
                                                (!others.empty()    ? ", there are:" + others
                                                 : !unasked.empty() ? "; " + unasked
                                                                    : ""));
}

/* Takes out the one that is shared from there; nothing: none. */
static std::string take_socket(std::vector<Shared> &shared, const std::string &serial, const std::string &port) {
  std::error_code none;
  std::string real_port = port.empty() ? "" : std::filesystem::canonical(port, none).string();
  auto at = std::find_if(shared.begin(), shared.end(), [&](const Shared &each) {
    return (!serial.empty() && is_same_serial(each.serial, serial)) || (!real_port.empty() && each.port == real_port);
  });
  if (at == shared.end()) {
    return "";
  }
  std::string socket = at->socket;
  shared.erase(at);
  return socket;
}

Finds find_fingertips(const std::string &root) {
  std::vector<Shared> shared = find_shared();
  Finds finds = {find_usb(root), find_in_environment()};
  for (Found &found : finds.here) {
    found.socket = take_socket(shared, found.serial, found.port);
  }
  for (Found &found : finds.in_environment) {
    found.socket = take_socket(shared, "", found.port);
  }
  for (const Shared &other : shared) {
    finds.here.push_back({other.serial, "", other.port, {}, other.socket});
  }
  return finds;
}

std::optional<Way> way_to(const Found &found, Reach reach) {
  if (!found.socket.empty() && (reach == Reach::automatic || reach == Reach::socket)) {
    return Way{found.serial, found.port, found.usb.has_value(), found.socket};
  }
  if (found.usb && (reach == Reach::usb || (reach == Reach::automatic && found.port.empty()))) {
    return Way{found.serial, "", true};
  }
  if (found.port.empty() || reach == Reach::usb || reach == Reach::socket) {
    return std::nullopt;
  }
  return Way{found.serial, found.port, found.usb.has_value()};
}

wire_info ask(const Way &way, const std::function<bool()> &stop, const std::string &root) {
  auto transport = open_way(way, root);
  Session session(*transport, stop);
  return session.info(QUICK).body.info;
}

Way choose_way(const Choice &wanted, const std::string &root) {
  Choice choice = wanted;
  if (!choice.port.empty()) {
    choice.port = port_of(choice.port);
    if (choice.reach == Reach::usb) {
      throw Error(ErrorCode::wrong_choice, "a serial port is not reached by libusb");
    }
    std::vector<Shared> shared = find_shared();
    const Found found = {"", "", stable_port(choice.port, root), {}, take_socket(shared, "", choice.port)};
    Way way = sure_way_to(found, choice.reach);
    if (!choice.device.empty()) {
      way.serial = serial_of(way, root);
      if (!is_same_serial(way.serial, choice.device)) {
        throw Error(ErrorCode::other_fingertip, choice.port + ": is fingertip " + way.serial + ", not " + choice.device);
      }
    }
    return way;
  }
  if (!choice.device.empty()) {
    return with_wanted_serial(choice, root);
  }
  Finds finds = find_fingertips(root);
  if (!finds.in_environment.empty() && choice.reach != Reach::usb) {
    return only_one(finds.in_environment, choice.reach, root, "");
  }
  return only_one(finds.here, choice.reach, root, choice.reach == Reach::usb ? "no fingertip found by libusb" : "no fingertip found");
}

std::vector<Way> all_ways(Reach reach, const std::string &root) {
  std::vector<Way> ways;
  Finds finds = find_fingertips(root);
  for (const Found &found : finds.here) {
    ways.push_back(sure_way_to(found, reach));
  }
  for (const Found &found : finds.in_environment) {
    if (auto way = way_to(found, reach)) {
      way->serial = serial_of(*way, root);
      ways.push_back(*way);
    }
  }
  return ways;
}

std::unique_ptr<Transport> open_way(const Way &way, const std::string &root) {
  if (!way.socket.empty()) {
    return std::make_unique<SocketTransport>(way.socket);
  }
  auto find_again = [serial = way.serial, root] {
    auto found = find_usb(root);
    const Found *again = with_serial(found, serial);
    return again ? again->port : std::string();
  };
  if (!way.port.empty()) {
    return std::make_unique<SerialTransport>(way.port, way.found_by_usb ? find_again : std::function<std::string()>());
  }
  /* libusb would take the port away from the program that has it open. */
  std::string port = find_again();
  if (!port.empty()) {
    SerialTransport::check_unused(port);
  }
  return std::make_unique<UsbTransport>(way.serial);
}

} // namespace fingertip
