# ZeroMQ, static, from its sources in ZEROMQ_SOURCE, with CURVE by libsodium. Its target is PkgConfig::mocap_client_zmq,
# the name that ../c/CMakeLists.txt uses.
foreach(unwanted BUILD_SHARED WITH_DOCS WITH_PERF_TOOL WITH_LIBBSD BUILD_TESTS ENABLE_CPACK)
  set(${unwanted} OFF CACHE BOOL "")
endforeach()
set(WITH_LIBSODIUM_STATIC ON CACHE BOOL "")
set(SODIUM_LIBRARIES libsodium::libsodium CACHE STRING "")
set(SODIUM_INCLUDE_DIRS ${SODIUM_SOURCE}/src/libsodium/include CACHE STRING "")
set(POLLER epoll CACHE STRING "")  # the bundled wepoll; select() serves at most 64 sockets
set(ZMQ_HAVE_IPC "" CACHE INTERNAL "")  # its sources need Microsoft's compiler for Unix domain sockets
add_subdirectory(${ZEROMQ_SOURCE} ${CMAKE_BINARY_DIR}/zeromq EXCLUDE_FROM_ALL)
# wepoll writes the names of headers as Windows accepts them, which MinGW on Linux does not.
foreach(header Windows WinSock2 WS2tcpip)
  string(TOLOWER ${header} name)
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/headers/wepoll/${header}.h CONTENT "#include <${name}.h>\n")
endforeach()
target_include_directories(libzmq-static PRIVATE ${CMAKE_BINARY_DIR}/headers/wepoll)
target_compile_options(libzmq-static PRIVATE -w)
# C++11 is ZeroMQ's own choice. Both settings save time: parsing windows.h and the standard library takes most of it.
set_target_properties(libzmq-static PROPERTIES CXX_STANDARD 11 UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 20)
add_library(PkgConfig::mocap_client_zmq INTERFACE IMPORTED GLOBAL)
target_link_libraries(PkgConfig::mocap_client_zmq INTERFACE libzmq-static)
target_compile_definitions(PkgConfig::mocap_client_zmq INTERFACE ZMQ_STATIC)
