# What `cmake --install` lays down: the library, its public headers and the CMake and pkg-config packages. The
# package can be moved as a whole: every path in it is relative.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/pileus)

set(include_dir ${CMAKE_INSTALL_INCLUDEDIR}/pileus)

# One include folder serves <pileus/pileus.h> and the headers' own "lib/core/error.h".
file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} lib/*.h pileus/*.h vdb_io/*.h)
file(STRINGS cmake/private_headers.txt private_headers REGEX "^[^#]")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS cmake/private_headers.txt)
list(REMOVE_ITEM headers ${private_headers})
foreach(header IN LISTS headers)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${header} DESTINATION ${include_dir}/${folder})
endforeach()
install(FILES ${PROJECT_BINARY_DIR}/generated/lib/core/version.h DESTINATION ${include_dir}/lib/core)
target_include_directories(pileus PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                         $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>
                                         $<INSTALL_INTERFACE:${include_dir}>)

set_target_properties(pileus PROPERTIES
                      VERSION ${PROJECT_VERSION}
                      SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
install(TARGETS pileus EXPORT pileusTargets)
install(EXPORT pileusTargets NAMESPACE pileus:: DESTINATION ${package_dir})
configure_package_config_file(cmake/pileusConfig.cmake.in ${PROJECT_BINARY_DIR}/pileusConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/pileusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/pileusConfig.cmake ${PROJECT_BINARY_DIR}/pileusConfigVersion.cmake
              cmake/FindOpenVDB.cmake cmake/PileusPluginLibrary.cmake
        DESTINATION ${package_dir})

file(RELATIVE_PATH PILEUS_PREFIX_FROM_PC /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/pileus.pc.in ${PROJECT_BINARY_DIR}/pileus.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/pileus.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
