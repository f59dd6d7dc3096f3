# Installs the package, moves it, and builds the project in outside/ against it: once with find_package, once with
# pkg-config. Stops at the first step that fails.
cmake_minimum_required(VERSION 3.24)

# run(STEP COMMAND...) runs a command, stops the test where it fails, and leaves what it wrote in `output`.
function(run step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${step} failed (${result}):\n${output}")
  endif()
  message(STATUS "${step}: ok")
  set(output "${output}" PARENT_SCOPE)
endfunction()

# expect_refusal(STEP EXPECTED COMMAND...) runs a command that must fail with a message.
function(expect_refusal step expected)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(result EQUAL 0)
    message(FATAL_ERROR "${step} went well; expected a refusal:\n${output}")
  endif()
  expect_output("${step}" "${expected}")
  message(STATUS "${step}: refused")
endfunction()

function(expect_output step expected)
  if(NOT output MATCHES "${expected}")
    message(FATAL_ERROR "${step} printed\n${output}\nwhich does not match\n${expected}")
  endif()
endfunction()

# The prefix is not the one that was installed to: a package that holds an absolute path fails below.
file(REMOVE_RECURSE ${WORK_DIR})
run("install" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/before)
file(RENAME ${WORK_DIR}/before ${WORK_DIR}/after)
set(prefix ${WORK_DIR}/after)

# Every installed header, in one file that sees fmt and Imath only.
file(GLOB_RECURSE headers RELATIVE ${prefix}/include/pileus ${prefix}/include/pileus/*.h)
list(REMOVE_ITEM headers vdb_io/openvdb/grid_to_field.h)  # shows OpenVDB's types, and says so
list(TRANSFORM headers REPLACE "(.+)" "#include <\\1>\n")
list(JOIN headers "" all_headers)
file(WRITE ${WORK_DIR}/all_headers.cpp "${all_headers}")

run("configure" ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/outside -B ${WORK_DIR}/build -G ${GENERATOR}
    -D CMAKE_CXX_COMPILER=${CXX} -D CMAKE_PREFIX_PATH=${prefix}
    -D PLUGIN=${PLUGIN} -D ALL_HEADERS=${WORK_DIR}/all_headers.cpp)
run("build" ${CMAKE_COMMAND} --build ${WORK_DIR}/build)
set(plugin ${WORK_DIR}/build/cornette_shanks.so)
set(scene ${CMAKE_CURRENT_LIST_DIR}/outside/scene.toml)
set(expected "^pileus ${VERSION}\n32 x 18\n$")
run("render" ${WORK_DIR}/build/outside ${plugin} ${scene} ${WORK_DIR}/find_package.exr)
expect_output("the program built with find_package" "${expected}")

set(ENV{PKG_CONFIG_PATH} ${prefix}/${LIBDIR}/pkgconfig)
run("pkg-config" pkg-config --cflags --libs pileus)
separate_arguments(flags UNIX_COMMAND "${output}")
run("compile by hand" ${CXX} -std=c++20 ${CMAKE_CURRENT_LIST_DIR}/outside/main.cpp -o ${WORK_DIR}/by_hand ${flags})
set(ENV{LD_LIBRARY_PATH} ${prefix}/${LIBDIR})
run("render by hand" ${WORK_DIR}/by_hand ${plugin} ${scene} ${WORK_DIR}/pkg_config.exr)
expect_output("the program built with pkg-config" "${expected}")
unset(ENV{LD_LIBRARY_PATH})

# The installed program finds its library by itself, takes the plugin from the path, and renders the same picture.
set(ENV{PILEUS_PLUGIN_PATH} ${WORK_DIR}/build)
run("plugins" ${prefix}/bin/pileus plugins cornette_shanks)
expect_output("pileus plugins" "-1 < g < 1")
run("render with the program" ${prefix}/bin/pileus render ${scene} -o ${WORK_DIR}/program.exr --quiet)
run("diff" ${prefix}/bin/pileus diff ${WORK_DIR}/find_package.exr ${WORK_DIR}/program.exr --fail "max>0")

# A program that hands over a grid of its own.
run("show an OpenVDB grid" ${WORK_DIR}/build/own_grid)
expect_output("the program with an OpenVDB grid" "^0\\.75\n$")

# What needs OpenVDB finds it through a library of its own beside libpileus; all else works without.
set(cloud ${CMAKE_CURRENT_LIST_DIR}/outside/cloud.toml)
set(render_cloud ${prefix}/bin/pileus render ${cloud} -o ${WORK_DIR}/cloud.exr --quiet)
run("render a cloud" ${render_cloud})
file(REMOVE ${prefix}/${LIBDIR}/libpileus_openvdb.so)
expect_refusal("render a cloud without the library" "libpileus_openvdb.so: error: volume .cloud.: cannot be loaded" ${render_cloud})
run("render no cloud without the library" ${prefix}/bin/pileus render ${scene} -o ${WORK_DIR}/without.exr --quiet)

# OpenImageIO is found through a library of its own beside libpileus; without it, or with that of another version, all
# but pictures other than EXR works, and is refused before the render.
set(pictures ${prefix}/${LIBDIR}/libpileus_pictures.so)
set(render_png ${prefix}/bin/pileus render ${scene} -o ${WORK_DIR}/program.png --quiet)
run("render a PNG picture" ${render_png})
run("read a PNG picture" ${prefix}/bin/pileus diff ${WORK_DIR}/program.png ${WORK_DIR}/program.png --fail "max>0")
run("libraries that every start loads" ldd ${prefix}/bin/pileus)
if(output MATCHES "OpenImageIO|openvdb|assimp")
  message(FATAL_ERROR "${CMAKE_MATCH_0} is loaded at every start:\n${output}")
endif()
file(REMOVE ${pictures})
expect_refusal("render PNG without the library" "libpileus_pictures.so: error: cannot be loaded" ${render_png})
run("render EXR without the library" ${prefix}/bin/pileus render ${scene} -o ${WORK_DIR}/without.exr --quiet)
run("diff without the library" ${prefix}/bin/pileus diff ${WORK_DIR}/program.exr ${WORK_DIR}/without.exr --fail "max>0")
file(WRITE ${WORK_DIR}/other_version.cpp [[
extern "C" const char* pileus_pictures_version() { return "0.0.9"; }
extern "C" const void* pileus_pictures() { return nullptr; }
]])
run("compile another version" ${CXX} -shared -fPIC ${WORK_DIR}/other_version.cpp -o ${pictures})
expect_refusal("render PNG with another version" "version 0\\.0\\.9; expected ${VERSION}" ${render_png})
