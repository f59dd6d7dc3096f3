#pragma once

#include <string>  // tells the standard library

#include <ImathConfig.h>

// What must agree between the program and a plugin library for virtual calls and shared types to mean the
// same: the plugin interface's own version (raise it with every change of an interface header), the C++ ABI
// of the compiler and its standard library, and Imath's, whose types cross the border.
#define PILEUS_PLUGIN_INTERFACE_VERSION 7

#define PILEUS_STRINGIFY_(x) #x
#define PILEUS_STRINGIFY(x) PILEUS_STRINGIFY_(x)
#ifdef _LIBCPP_VERSION
#define PILEUS_STANDARD_LIBRARY "libc++"
#else
#define PILEUS_STANDARD_LIBRARY "libstdc++-cxx11-" PILEUS_STRINGIFY(_GLIBCXX_USE_CXX11_ABI)
#endif

#define PILEUS_PLUGIN_ABI                                                                          \
  "pileus-plugin-" PILEUS_STRINGIFY(PILEUS_PLUGIN_INTERFACE_VERSION) " gxx-abi-" PILEUS_STRINGIFY( \
      __GXX_ABI_VERSION) " " PILEUS_STANDARD_LIBRARY " imath-" IMATH_VERSION_STRING
