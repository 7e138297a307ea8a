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
static std::string serial_of(const Endpoint &endpoint, const std::string &root) {
  return text_field(ask(
                        endpoint, [] { return false; }, root)
                        .serial);
}

/* Throws Error where there is none. */
static Endpoint sure_endpoint_of(const Found &found, TransportKind kind) {
  if (auto endpoint = endpoint_of(found, kind)) {
    return *endpoint;
  }
  if (kind == TransportKind::socket) {
    throw Error(ErrorCode::not_shared, (found.serial.empty() ? found.port : found.serial) + ": no program shares it");
  }
  throw Error(ErrorCode::no_driver, found.serial + ": has no serial port: its driver cdc_acm is not "
                                                   "loaded, or another program uses it by libusb");
}

/* Its serial number, or its port if that is unknown. */
static std::string name_of(const Found &found, TransportKind kind, const std::string &root) {
  if (!found.serial.empty()) {
    return found.serial;
  }
  try {
    if (auto endpoint = endpoint_of(found, kind)) {
      return serial_of(*endpoint, root) + " (" + found.port + ")";
    }
  } catch (const Error &) {
    /* the port has to do */
  }
  return found.port;
}

static Endpoint only_one(const std::vector<Found> &found, TransportKind kind, const std::string &root, const std::string &none) {
  if (found.empty()) {
    const std::string boot_rom = find_boot_rom(root);
    throw Error(ErrorCode::no_fingertip, none + (boot_rom.empty() ? "" : ", but " + boot_rom));
  }
  if (found.size() > 1) {
    throw Error(ErrorCode::several_fingertips,
                "several fingertips found: " + joined(found, ", ", [&](const Found &each) { return name_of(each, kind, root); }));
  }
  return sure_endpoint_of(found[0], kind);
}

static Endpoint with_wanted_serial(const Choice &choice, const std::string &root) {
  FoundDevices devices = find_fingertips(root);
  if (const Found *found = with_serial(devices.here, choice.device)) {
    return sure_endpoint_of(*found, choice.transport);
  }
  std::string others;
  std::string unasked;
  for (const Found &found : devices.here) {
    others += " " + found.serial;
  }
  for (const Found &found : devices.in_environment) {
    auto endpoint = endpoint_of(found, choice.transport);
    if (!endpoint) {
      continue;
    }
    try {
      endpoint->serial = serial_of(*endpoint, root);
    } catch (const Error &error) {
      unasked = std::string(error.what());
      continue;
    }
    if (is_same_serial(endpoint->serial, choice.device)) {
      return *endpoint;
    }
    others += " " + endpoint->serial;
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

FoundDevices find_fingertips(const std::string &root) {
  std::vector<Shared> shared = find_shared();
  FoundDevices devices = {find_usb(root), find_in_environment()};
  for (Found &found : devices.here) {
    found.socket = take_socket(shared, found.serial, found.port);
  }
  for (Found &found : devices.in_environment) {
    found.socket = take_socket(shared, "", found.port);
  }
  for (const Shared &other : shared) {
    devices.here.push_back({other.serial, "", other.port, {}, other.socket});
  }
  return devices;
}

std::optional<Endpoint> endpoint_of(const Found &found, TransportKind kind) {
  if (!found.socket.empty() && (kind == TransportKind::automatic || kind == TransportKind::socket)) {
    return Endpoint{found.serial, found.port, found.usb.has_value(), found.socket};
  }
  if (found.usb && (kind == TransportKind::usb || (kind == TransportKind::automatic && found.port.empty()))) {
    return Endpoint{found.serial, "", true};
  }
  if (found.port.empty() || kind == TransportKind::usb || kind == TransportKind::socket) {
    return std::nullopt;
  }
  return Endpoint{found.serial, found.port, found.usb.has_value()};
}

wire_info ask(const Endpoint &endpoint, const std::function<bool()> &stop, const std::string &root) {
  auto transport = open_endpoint(endpoint, root);
  Session session(*transport, stop);
  return session.info(QUICK).body.info;
}

Endpoint choose_endpoint(const Choice &wanted, const std::string &root) {
  Choice choice = wanted;
  if (!choice.port.empty()) {
    choice.port = port_of(choice.port);
    if (choice.transport == TransportKind::usb) {
      throw Error(ErrorCode::wrong_choice, "a serial port is not reached by libusb");
    }
    std::vector<Shared> shared = find_shared();
    const Found found = {"", "", stable_port(choice.port, root), {}, take_socket(shared, "", choice.port)};
    Endpoint endpoint = sure_endpoint_of(found, choice.transport);
    if (!choice.device.empty()) {
      endpoint.serial = serial_of(endpoint, root);
      if (!is_same_serial(endpoint.serial, choice.device)) {
        throw Error(ErrorCode::other_fingertip, choice.port + ": is fingertip " + endpoint.serial + ", not " + choice.device);
      }
    }
    return endpoint;
  }
  if (!choice.device.empty()) {
    return with_wanted_serial(choice, root);
  }
  FoundDevices devices = find_fingertips(root);
  if (!devices.in_environment.empty() && choice.transport != TransportKind::usb) {
    return only_one(devices.in_environment, choice.transport, root, "");
  }
  return only_one(devices.here, choice.transport, root,
                  choice.transport == TransportKind::usb ? "no fingertip found by libusb" : "no fingertip found");
}

std::vector<Endpoint> all_endpoints(TransportKind kind, const std::string &root) {
  std::vector<Endpoint> endpoints;
  FoundDevices devices = find_fingertips(root);
  for (const Found &found : devices.here) {
    endpoints.push_back(sure_endpoint_of(found, kind));
  }
  for (const Found &found : devices.in_environment) {
    if (auto endpoint = endpoint_of(found, kind)) {
      endpoint->serial = serial_of(*endpoint, root);
      endpoints.push_back(*endpoint);
    }
  }
  return endpoints;
}

std::unique_ptr<Transport> open_endpoint(const Endpoint &endpoint, const std::string &root) {
  if (!endpoint.socket.empty()) {
    return std::make_unique<SocketTransport>(endpoint.socket);
  }
  auto find_again = [serial = endpoint.serial, root] {
    auto found = find_usb(root);
    const Found *again = with_serial(found, serial);
    return again ? again->port : std::string();
  };
  if (!endpoint.port.empty()) {
    return std::make_unique<SerialTransport>(endpoint.port, endpoint.found_by_usb ? find_again : std::function<std::string()>());
  }
  /* libusb would take the port away from the program that has it open. */
  std::string port = find_again();
  if (!port.empty()) {
    SerialTransport::check_unused(port);
  }
  return std::make_unique<UsbTransport>(endpoint.serial);
}

} // namespace fingertip
