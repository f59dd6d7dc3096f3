# Renders one scene tiny, as it is and by the reference integrator, and compares the pictures: no value may differ by more
# than the scene's tolerance and the reference's.
#
#   PROGRAM          pileus
#   SCENE, FOLDER    the input, and where the pictures go
#   OPTIONS          further arguments of both renders
#   THRESHOLD        greatest difference per channel
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

set(common ${SCENE} --size 20x12 --set render.pixel_samples=1 --aov beauty ${OPTIONS})
run(render ${common} -o ${picture})
run(render ${common} -o ${exact} --integrator exact --tolerance 0.0002)
run(diff ${picture} ${exact} --fail "max>${THRESHOLD}")
