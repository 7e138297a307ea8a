// Nothing: its precompiled header is what others use (tests/CMakeLists.txt).
