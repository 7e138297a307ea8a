# What is built: a board, a scene, and the identity that the image carries.

include(boards)
set(FINGERTIP_BOARD native CACHE STRING "Board: one of ${FINGERTIP_BOARDS}")
set_property(CACHE FINGERTIP_BOARD PROPERTY STRINGS ${FINGERTIP_BOARDS})
if(NOT FINGERTIP_BOARD IN_LIST FINGERTIP_BOARDS)
  message(FATAL_ERROR "FINGERTIP_BOARD=${FINGERTIP_BOARD} is unknown; choose one of: ${FINGERTIP_BOARDS}")
endif()
if(NOT FINGERTIP_BOARD STREQUAL "native" AND NOT CMAKE_CROSSCOMPILING)
  message(FATAL_ERROR "Board ${FINGERTIP_BOARD} needs the cross compiler: use -DCMAKE_TOOLCHAIN_FILE=cmake/toolchain-arm-none-eabi.cmake")
endif()

# A scene is a named set of capabilities and defaults for one use of the fingertip.
#   raw     pressures and tare only
#   press   location and force, in the least flash
#   slip    location, force, slip, raw packets, sync pin: the least latency
#   grasp   as slip, with tangential force, a search for outliers, and the location's error where none is estimated
#   shapes  as grasp, with contact shapes: two contacts, edges
#   paper   as slip, in the published setting: 20 Hz, slip by eq. (7) with n = 2
# host_tools/README.md has the table of what each computes, leaves out and costs.
set(FINGERTIP_SCENES raw press slip grasp shapes paper)
set(FINGERTIP_DEFAULT_SCENE grasp)
set(FINGERTIP_SCENE ${FINGERTIP_DEFAULT_SCENE} CACHE STRING "Scene: one of ${FINGERTIP_SCENES}")
set_property(CACHE FINGERTIP_SCENE PROPERTY STRINGS ${FINGERTIP_SCENES})
if(NOT FINGERTIP_SCENE IN_LIST FINGERTIP_SCENES)
  message(FATAL_ERROR "FINGERTIP_SCENE=${FINGERTIP_SCENE} is unknown; choose one of: ${FINGERTIP_SCENES}")
endif()

# Capabilities: what is off is not compiled. It leaves no symbol, no variable and no field of a packet. The firmware's
# sources have each as FT_WITH_..., 0 or 1.
#   FIT               location, force, and the contact packets
#   FULL_GRID         the kernel for full rectangles: faster, and with separate widths and ELONGATED (fit.h); without
#                     it, that for missing sensors fits all frames
#   OUTLIERS          a search for a sensor whose reading does not belong to the others'; FIT_GENERAL has it always
#   TANGENTIAL_BIAS   what a tangential force that is not estimated does to the standard deviation of the location
#                     (fit_bias.h), and learning from touches how far gains are apart (fit_gains.h)
#   SLIP              slip, and the command that sets it
#   TANGENTIAL        tangential force, and the commands that bring and erase the pad's profile
#   SHAPES            contact shapes: two contacts, edges (fit_shapes.h)
#   RAW_STREAM        the raw packets
#   SYNC              the sync pin, its packets, and the command that sets it
set(FINGERTIP_CAPABILITIES FIT FULL_GRID OUTLIERS TANGENTIAL_BIAS SLIP TANGENTIAL SHAPES RAW_STREAM SYNC)
set(capabilities_of_raw RAW_STREAM)
set(capabilities_of_press FIT)
set(capabilities_of_slip FIT FULL_GRID SLIP RAW_STREAM SYNC)
set(capabilities_of_grasp FIT FULL_GRID OUTLIERS TANGENTIAL_BIAS SLIP TANGENTIAL RAW_STREAM SYNC)
set(capabilities_of_shapes ${capabilities_of_grasp} SHAPES)
set(capabilities_of_paper FIT FULL_GRID OUTLIERS SLIP RAW_STREAM SYNC)
foreach(capability IN LISTS FINGERTIP_CAPABILITIES)
  set(option FINGERTIP_${capability})
  set(${option} SCENE CACHE STRING "ON, OFF, or SCENE: as the scene has it")
  set_property(CACHE ${option} PROPERTY STRINGS ON OFF SCENE)
  if(${option} STREQUAL "SCENE")
    set(wanted FALSE)
    if(capability IN_LIST capabilities_of_${FINGERTIP_SCENE})
      set(wanted TRUE)
    endif()
  elseif(${option} MATCHES "^(ON|OFF)$")
    set(wanted ${${option}})
  else()
    message(FATAL_ERROR "${option}=${${option}} must be ON, OFF or SCENE")
  endif()
  set(FT_WITH_${capability} $<BOOL:${wanted}>) # 0 or 1
  set(has_${capability} ${wanted})
endforeach()
foreach(capability FULL_GRID OUTLIERS TANGENTIAL_BIAS SLIP TANGENTIAL)
  if(has_${capability} AND NOT has_FIT)
    message(FATAL_ERROR "FINGERTIP_${capability} needs FINGERTIP_FIT: it is found from fits")
  endif()
endforeach()
if(has_OUTLIERS AND NOT has_FULL_GRID)
  message(FATAL_ERROR "FINGERTIP_OUTLIERS needs FINGERTIP_FULL_GRID: a search takes the time that the faster kernel saves")
endif()
if(has_SHAPES AND NOT has_TANGENTIAL)
  message(FATAL_ERROR "FINGERTIP_SHAPES needs FINGERTIP_TANGENTIAL: both need the pad's profile")
endif()
if(NOT has_FIT AND NOT has_RAW_STREAM)
  message(FATAL_ERROR "with FINGERTIP_FIT and FINGERTIP_RAW_STREAM off nothing would be streamed; switch one on")
endif()

# The general kernel fits layouts other than the full rectangle that the fixed-point ones are compiled
# for. The host's tools compare with it; an image of a full rectangle never calls it.
if(FINGERTIP_BOARD STREQUAL "native")
  set(general_by_default ON)
else()
  set(general_by_default OFF)
endif()
option(FINGERTIP_FIT_GENERAL "Fit any layout, with the float kernel" ${general_by_default})

set(FINGERTIP_FIT_ITERATIONS 4 CACHE STRING "Gauss-Newton iterations of every fit, 1 to 20")
if(NOT FINGERTIP_FIT_ITERATIONS MATCHES "^([1-9]|1[0-9]|20)$")
  message(FATAL_ERROR "FINGERTIP_FIT_ITERATIONS=${FINGERTIP_FIT_ITERATIONS} must be a whole number from 1 to 20")
endif()

# Prior on the width of the contact, for rubber so stiff that the array can hardly measure it: the sigma
# that the pad gives (`twin width` computes it) and how sure that is. 0: none.
set(FINGERTIP_PRIOR_SIGMA_UM 0 CACHE STRING "Prior on sigma, micrometres; 0 for none")
set(FINGERTIP_PRIOR_WIDTH_UM 500 CACHE STRING "Standard deviation of that prior, micrometres")
foreach(option FINGERTIP_PRIOR_SIGMA_UM FINGERTIP_PRIOR_WIDTH_UM)
  if(NOT ${option} MATCHES "^[0-9]+$" OR ${option} GREATER 1000000)
    message(FATAL_ERROR "${option}=${${option}} must be a whole number of micrometres, at most 1000000")
  endif()
endforeach()

# GPIO 23 sets the regulator's mode on a Pico, and powers the radio on a Pico W.
option(FINGERTIP_PICO_W "For a Pico W: leave GPIO 23 alone" OFF)

# 1209:0001 is the pid.codes id for tests: a product needs its own.
set(FINGERTIP_USB_VID 0x1209 CACHE STRING "USB vendor id")
set(FINGERTIP_USB_PID 0x0001 CACHE STRING "USB product id")

option(BUILD_TESTING "On the host: build the tests, the reference fit and the reports too" ON)

option(FINGERTIP_SANITIZE "Build for the host with the address and undefined-behaviour sanitizers" OFF)

option(FINGERTIP_FUZZ "Build the fuzz targets by clang into build/fuzz, and run them as tests" OFF)
option(FINGERTIP_WEB "Build the page that `fingertip web` serves: fetches with npm what it is made of, needs clang for WebAssembly" OFF)
option(FINGERTIP_LIBFUZZER "Build for libFuzzer: clang only, cmake --preset fuzz" OFF)
