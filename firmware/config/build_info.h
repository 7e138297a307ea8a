/* The identity of this build, written by the build itself. */
#pragma once

#include <stdint.h>

struct build_info {
  uint8_t version[3];   /* major, minor, patch */
  const char *git_hash; /* 12 digits; '+' appended for uncommitted changes */
  const char *board;
  const char *scene;
};

extern const struct build_info build_info;
