# Finds OpenVDB, which ships no CMake package of its own. Defines OpenVDB::openvdb, OpenVDB_FOUND, OpenVDB_VERSION.
# Set OpenVDB_ROOT (or CMAKE_PREFIX_PATH) where it is not in a usual place.
include(FindPackageHandleStandardArgs)
include(CMakeFindDependencyMacro)

find_path(OpenVDB_INCLUDE_DIR openvdb/version.h)
find_library(OpenVDB_LIBRARY openvdb)
mark_as_advanced(OpenVDB_INCLUDE_DIR OpenVDB_LIBRARY)

if(OpenVDB_INCLUDE_DIR)
  file(STRINGS ${OpenVDB_INCLUDE_DIR}/openvdb/version.h OpenVDB_lines
       REGEX "#define OPENVDB_LIBRARY_(MAJOR|MINOR|PATCH)_VERSION_NUMBER [0-9]+")
  string(REGEX REPLACE "[^;]* ([0-9]+)" "\\1" OpenVDB_VERSION "${OpenVDB_lines}")
  list(JOIN OpenVDB_VERSION "." OpenVDB_VERSION)
endif()

find_package_handle_standard_args(OpenVDB REQUIRED_VARS OpenVDB_LIBRARY OpenVDB_INCLUDE_DIR
                                  VERSION_VAR OpenVDB_VERSION)

if(OpenVDB_FOUND AND NOT TARGET OpenVDB::openvdb)
  find_dependency(TBB CONFIG)
  find_dependency(Imath CONFIG)
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES IMPORTED_LOCATION ${OpenVDB_LIBRARY})
  target_include_directories(OpenVDB::openvdb SYSTEM INTERFACE ${OpenVDB_INCLUDE_DIR})
  target_link_libraries(OpenVDB::openvdb INTERFACE TBB::tbb Imath::Imath)
endif()
