# What is built: a board, a scene, and the identity that the image carries.

set(FINGERTIP_BOARDS native pico_mux pico_parallel)
set(FINGERTIP_BOARD native CACHE STRING "Board: one of ${FINGERTIP_BOARDS}")
set_property(CACHE FINGERTIP_BOARD PROPERTY STRINGS ${FINGERTIP_BOARDS})
if(NOT FINGERTIP_BOARD IN_LIST FINGERTIP_BOARDS)
  message(FATAL_ERROR "FINGERTIP_BOARD=${FINGERTIP_BOARD} is unknown; choose one of: ${FINGERTIP_BOARDS}")
endif()
if(NOT FINGERTIP_BOARD STREQUAL "native" AND NOT CMAKE_CROSSCOMPILING)
  message(FATAL_ERROR "Board ${FINGERTIP_BOARD} needs the cross compiler: use cmake --preset ${FINGERTIP_BOARD}")
endif()

# A scene is a named set of defaults for one use of the fingertip.
#   slip   every frame the sensors can give; location, force and slip
#   paper  the published setting: 20 Hz, slip by eq. (7) with n = 2
set(FINGERTIP_SCENES slip paper)
set(FINGERTIP_SCENE slip CACHE STRING "Scene: one of ${FINGERTIP_SCENES}")
set_property(CACHE FINGERTIP_SCENE PROPERTY STRINGS ${FINGERTIP_SCENES})
if(NOT FINGERTIP_SCENE IN_LIST FINGERTIP_SCENES)
  message(FATAL_ERROR "FINGERTIP_SCENE=${FINGERTIP_SCENE} is unknown; choose one of: ${FINGERTIP_SCENES}")
endif()

set(FINGERTIP_FIT_ITERATIONS 7 CACHE STRING "Gauss-Newton iterations of every fit, 1 to 20")
if(NOT FINGERTIP_FIT_ITERATIONS MATCHES "^([1-9]|1[0-9]|20)$")
  message(FATAL_ERROR "FINGERTIP_FIT_ITERATIONS=${FINGERTIP_FIT_ITERATIONS} must be a whole number from 1 to 20")
endif()

# Prior on the width of the contact, for rubber so stiff that the array can hardly tell it: the sigma
# that the pad gives (about 0.45 of the rubber's thickness) and how sure that is. 0: none.
set(FINGERTIP_PRIOR_SIGMA_UM 0 CACHE STRING "Prior on sigma, micrometres; 0 for none")
set(FINGERTIP_PRIOR_WIDTH_UM 500 CACHE STRING "Standard deviation of that prior, micrometres")
foreach(option FINGERTIP_PRIOR_SIGMA_UM FINGERTIP_PRIOR_WIDTH_UM)
  if(NOT ${option} MATCHES "^[0-9]+$" OR ${option} GREATER 1000000)
    message(FATAL_ERROR "${option}=${${option}} must be a whole number of micrometres, at most 1000000")
  endif()
endforeach()

# 1209:0001 is the pid.codes id for tests: a product needs its own.
set(FINGERTIP_USB_VID 0x1209 CACHE STRING "USB vendor id")
set(FINGERTIP_USB_PID 0x0001 CACHE STRING "USB product id")

option(FINGERTIP_SANITIZE "Build for the host with the address and undefined-behaviour sanitizers" OFF)
