# Renders one scene tiny, as it is and by the reference integrator, and compares the pictures: no value may differ by more
# than the scene's tolerance and the reference's.
#
#   PROGRAM          pileus
#   SCENE, FOLDER    the input, and where the pictures go
#
# Tiny, so that the reference takes no longer than the picture: most of the time goes into building clouds.
cmake_minimum_required(VERSION 3.24)

get_filename_component(name ${SCENE} NAME_WE)
file(MAKE_DIRECTORY ${FOLDER})
set(picture ${FOLDER}/${name}.tiny.exr)
set(exact ${FOLDER}/${name}.exact.exr)
file(REMOVE ${picture} ${exact})

function(run)
  execute_process(COMMAND ${PROGRAM} ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "pileus ${ARGN} ended with ${result}:\n${output}")
  endif()
endfunction()

set(common ${SCENE} --size 20x12 --set render.pixel_samples=1 --aov beauty)
set(report ${FOLDER}/${name}.tiny.json)
run(render ${common} -o ${picture} --report ${report})
run(render ${common} -o ${exact} --integrator exact --tolerance 0.0002)
file(READ ${report} told)
string(JSON tolerance GET "${told}" tolerance)
# CMake knows integers alone: the two tolerances are added in millionths.
string(REGEX MATCH "^0\\.([0-9]*)$" is_fraction "${tolerance}")
if(NOT is_fraction)
  message(FATAL_ERROR "${SCENE} has the tolerance ${tolerance}; expected one between 0 and 1")
endif()
string(SUBSTRING "${CMAKE_MATCH_1}000000" 0 6 millionths)
math(EXPR allowed "1${millionths} + 200 - 1000000")
run(diff ${picture} ${exact} --fail "max>${allowed}e-6")
