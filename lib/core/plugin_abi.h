#pragma once

#include <ImathConfig.h>

// What must agree between the program and a plugin library for virtual calls and shared types to mean the
// same: the plugin interface's own version (raise it with every change of an interface header), the C++ ABI
// of the compiler and its standard library, and Imath's, whose types cross the border.
#define PILEUS_PLUGIN_INTERFACE_VERSION 1

#define PILEUS_STRINGIFY_(x) #x
#define PILEUS_STRINGIFY(x) PILEUS_STRINGIFY_(x)
#define PILEUS_PLUGIN_ABI                                                                          \
  "pileus-plugin-" PILEUS_STRINGIFY(PILEUS_PLUGIN_INTERFACE_VERSION) " gxx-abi-" PILEUS_STRINGIFY( \
      __GXX_ABI_VERSION) " imath-" IMATH_VERSION_STRING
