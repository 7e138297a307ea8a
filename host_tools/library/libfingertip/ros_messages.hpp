/* ROS 2 messages of a fingertip's reports, without ROS: their definitions, with the meaning of the numbers
 * (host_tools/python/fingertip/msg), and their CDR bytes. They have no header: "frame_id" and time are apart. */
#pragma once

#include "libfingertip/packet_fields.hpp"
#include "libfingertip/wire.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip::ros {

/* The definitions of messages by their names, "geometry_msgs/Wrench", as the files .msg have them. */
const std::map<std::string, std::string> &definitions();

/* The schema of a message such as "geometry_msgs/WrenchStamped", with all that it needs, in the encoding ros2msg. */
std::string schema_of(const std::string &name);

/* A name for topics and coordinate frames, which hold letters, digits and _, and begin with no digit. */
std::string name_in_ros(const std::string &serial);

/* The latest time that a message can hold, ns since 1970. */
inline constexpr std::uint64_t LATEST_ns = 2'147'483'647'000'000'000;

struct Header {
  std::uint64_t time_ns;
  std::string frame_id;
};

/* geometry_msgs/WrenchStamped and PointStamped. */
std::string wrench(const Header &header, const wire_contact &contact);
std::string place(const Header &header, const wire_contact &contact);

/* sensor_msgs/PointCloud2; x_mm and y_mm of each sensor. */
std::string pressures(const Header &header, const wire_raw &raw, const std::vector<float> &x_mm, const std::vector<float> &y_mm);

/* diagnostic_msgs/DiagnosticArray of one status: a health packet's, and a contact's warnings. */
std::string health(const Header &header, const std::string &serial, unsigned sensors, const Metadata &fields);
std::string warnings(const Header &header, const std::string &serial, std::uint32_t flags);

/* fingertip_msgs/Line. */
struct Line {
  std::uint64_t number = 0;
  std::string text;
  bool torn = false;
};
std::string encode(const Header &header, const Line &line);
std::optional<Line> decode_line(std::string_view bytes);
/* Of a Line or a Contact; 0 of what is neither. */
std::uint64_t line_number(std::string_view bytes);
/* x or y of each sensor (axis 0 or 1), in sensor_msgs/PointCloud2 as pressures makes it; none if it is another. */
std::vector<double> locations_mm(std::string_view bytes, std::size_t sensors, std::size_t axis);

/* fingertip_msgs/Contact: the packets of a row of a recording, one of them at least. */
struct Row {
  std::uint64_t number = 0;
  std::uint32_t device = 0;
  std::optional<double> time_us; /* of a recording of several */
  std::optional<wire_packet> contact, raw;
};
std::string encode(const Header &header, const Row &row);
/* Nothing of bytes that are none. */
std::optional<Row> decode_row(std::string_view bytes);

} // namespace fingertip::ros
