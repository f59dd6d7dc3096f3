# Renders one scene small, through the program or another one, and judges the picture: no pixel may be other than a
# number, and the picture must show something.
#
#   PROGRAM, ARGUMENTS   what renders; ARGUMENTS may hold @SCENE@ and @PICTURE@
#   SCENE, PICTURE       the input and the .exr output
#   JUDGE                the program that says whether the picture is fine
cmake_minimum_required(VERSION 3.24)

string(CONFIGURE "${ARGUMENTS}" arguments @ONLY)
string(REPLACE "|" ";" arguments "${arguments}")
get_filename_component(folder ${PICTURE} DIRECTORY)
file(MAKE_DIRECTORY ${folder})
file(REMOVE ${PICTURE})
execute_process(COMMAND ${PROGRAM} ${arguments} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} ended with ${result}:\n${output}")
endif()
execute_process(COMMAND ${JUDGE} ${PICTURE} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${output}")
endif()
