# libsodium, static, from its sources in SODIUM_SOURCE. libsodium's own build needs autoconf, automake and libtool; its
# folder builds/msvc has the one generated header. Compiles the portable implementations, with 128-bit products.
file(GLOB_RECURSE sodium_files CONFIGURE_DEPENDS ${SODIUM_SOURCE}/src/libsodium/*.c)
add_library(sodium STATIC ${sodium_files})
set(sodium_headers ${SODIUM_SOURCE}/src/libsodium/include)
configure_file(${SODIUM_SOURCE}/builds/msvc/version.h ${sodium_headers}/sodium/version.h COPYONLY)
target_include_directories(sodium SYSTEM PUBLIC ${sodium_headers} PRIVATE ${sodium_headers}/sodium)
target_compile_definitions(sodium PUBLIC SODIUM_STATIC PRIVATE CONFIGURED=1 NATIVE_LITTLE_ENDIAN=1 HAVE_TI_MODE=1)
target_compile_options(sodium PRIVATE -w)
target_link_libraries(sodium PRIVATE advapi32)
# The name by which ZeroMQ's build, which exports its targets, may link a target that is not exported.
add_library(libsodium::libsodium INTERFACE IMPORTED GLOBAL)
target_link_libraries(libsodium::libsodium INTERFACE sodium)
