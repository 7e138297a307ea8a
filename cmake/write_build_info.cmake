# Writes OUTPUT, a C file with the identity of the build, only when it changes.
find_package(Git QUIET)
set(hash unknown)
if(GIT_FOUND)
  execute_process(COMMAND ${GIT_EXECUTABLE} -C ${SOURCE_DIR} rev-parse --short=12 HEAD
    OUTPUT_VARIABLE head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    execute_process(COMMAND ${GIT_EXECUTABLE} -C ${SOURCE_DIR} status --porcelain
      OUTPUT_VARIABLE changes ERROR_QUIET)
    set(hash ${head})
    if(changes)
      string(APPEND hash "+")
    endif()
  endif()
endif()
string(REPLACE "." ", " version_bytes ${VERSION})
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT [[
#include "config/build_info.h"

/* With marks that show an image file's identity to the installer. */
#define MARKED(name, mark, text) \
  static const char name[] = mark text; \
  enum { name##_at = sizeof mark - 1 }
MARKED(git_hash, "fingertip-version=@VERSION@ fingertip-git=", "@hash@");
MARKED(board, "fingertip-board=", "@BOARD@");
MARKED(scene, "fingertip-scene=", "@SCENE@");

const struct build_info build_info = {
    .version = {@version_bytes@},
    .git_hash = git_hash + git_hash_at,
    .board = board + board_at,
    .scene = scene + scene_at,
};
]] @ONLY)
