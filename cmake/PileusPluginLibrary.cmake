# pileus_add_plugin_library(NAME FILE) builds one plugin file into NAME.so, which the program loads at run time
# (PILEUS_PLUGIN_PATH, or Registry::load_library). The same in the project's own build and for users of the
# installed package.
function(pileus_add_plugin_library name file)
  add_library(${name} MODULE ${file})
  target_link_libraries(${name} PRIVATE pileus::pileus)
  target_compile_definitions(${name} PRIVATE PILEUS_BUILDING_PLUGIN_LIBRARY)
  set_target_properties(${name} PROPERTIES PREFIX "")
endfunction()
