# Finds NanoVDB's headers, which ship no CMake package of their own. Defines NanoVDB::nanovdb.
include(FindPackageHandleStandardArgs)

find_path(NanoVDB_INCLUDE_DIR nanovdb/util/GridStats.h)
mark_as_advanced(NanoVDB_INCLUDE_DIR)
find_package_handle_standard_args(NanoVDB REQUIRED_VARS NanoVDB_INCLUDE_DIR)

if(NanoVDB_FOUND AND NOT TARGET NanoVDB::nanovdb)
  add_library(NanoVDB::nanovdb INTERFACE IMPORTED)
  target_include_directories(NanoVDB::nanovdb SYSTEM INTERFACE ${NanoVDB_INCLUDE_DIR})
endif()
