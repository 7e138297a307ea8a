# Cortex-M0+ (RP2040) with Debian's gcc-arm-none-eabi and newlib.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR armv6-m)

find_program(FINGERTIP_ARM_GCC arm-none-eabi-gcc)
if(NOT FINGERTIP_ARM_GCC)
  message(FATAL_ERROR "arm-none-eabi-gcc is missing; install it: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi")
endif()
set(CMAKE_C_COMPILER ${FINGERTIP_ARM_GCC})
set(CMAKE_ASM_COMPILER ${FINGERTIP_ARM_GCC})
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m0plus -mthumb -ffunction-sections -fdata-sections -fno-common -fstack-usage")
set(CMAKE_ASM_FLAGS_INIT "-mcpu=cortex-m0plus -mthumb")
set(CMAKE_C_FLAGS_RELEASE_INIT "-Os -g")
set(CMAKE_C_FLAGS_RELEASE "-Os -g" CACHE STRING "")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-nostartfiles --specs=nano.specs")

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
