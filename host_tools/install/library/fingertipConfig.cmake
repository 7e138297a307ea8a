# find_package(fingertip): the target fingertip::fingertip.
include(CMakeFindDependencyMacro)
find_dependency(Threads)
include(${CMAKE_CURRENT_LIST_DIR}/fingertipTargets.cmake)
