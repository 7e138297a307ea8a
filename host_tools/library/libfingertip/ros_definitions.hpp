/* The definitions of messages by their names, "geometry_msgs/Wrench", as the files .msg have them.
 */
#pragma once

#include <map>
#include <string>

namespace fingertip::ros {

const std::map<std::string, std::string> &definitions();

} // namespace fingertip::ros
