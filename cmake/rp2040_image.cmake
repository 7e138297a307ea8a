# rp2040_image(target): makes an executable target an image for the RP2040: second boot stage,
# linker script, and TARGET.bin, .uf2 and .map beside the ELF file. Prints the size.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
find_program(FINGERTIP_ARM_SIZE arm-none-eabi-size REQUIRED)

# The board calls the USB device and the device calls the board, and so does the store.
set(CMAKE_C_LINK_GROUP_USING_BOTH_WAYS_SUPPORTED TRUE CACHE INTERNAL "")
set(CMAKE_C_LINK_GROUP_USING_BOTH_WAYS LINKER:--start-group LINKER:--end-group CACHE INTERNAL "")

function(rp2040_image target)
  set(linker_script ${CMAKE_SOURCE_DIR}/boards/rp2040/rp2040.ld)
  target_link_libraries(${target} PRIVATE "$<LINK_GROUP:BOTH_WAYS,board_rp2040,ft_usb,ft_store>" rp2040_boot2)
  target_link_options(${target} PRIVATE
    -T ${linker_script} -Wl,--gc-sections,--orphan-handling=error,--fatal-warnings
    -Wl,--undefined=__aeabi_fsub # before the library's own is searched
    -Wl,-Map=${CMAKE_BINARY_DIR}/${target}.map)
  set_target_properties(${target} PROPERTIES
    RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR} SUFFIX .elf LINK_DEPENDS ${linker_script})
  set(files ${CMAKE_BINARY_DIR}/${target})
  add_custom_command(TARGET ${target} POST_BUILD
    COMMAND ${CMAKE_OBJCOPY} -O binary ${files}.elf ${files}.bin
    COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/cmake/bin2uf2.py ${files}.bin ${files}.uf2
    COMMAND ${FINGERTIP_ARM_SIZE} ${files}.elf
    BYPRODUCTS ${files}.bin ${files}.uf2 ${files}.map VERBATIM)
endfunction()
