# SPDX-License-Identifier: Apache-2.0
# Message packages installed as wheels export the include directories of Python and numpy on the
# machine that built them. Where those do not exist, this machine's own take their place, so that
# packages that depend on such messages generate. Where all exist (an apt install), nothing changes.
#
# colcon.meta hands this file to a package as CMAKE_PROJECT_<name>_INCLUDE; the repair is deferred to
# the end of the package's CMakeLists.txt, when all imported targets are known.

function(_find_python_include_directories result)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  execute_process(
    COMMAND "${Python3_EXECUTABLE}" -c
      "import numpy, sysconfig; print(sysconfig.get_path('include') + ';' + numpy.get_include())"
    OUTPUT_VARIABLE directories
    OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  set(${result} "${directories}" PARENT_SCOPE)
endfunction()

function(_repair_exported_paths)
  get_property(targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  list(FILTER targets INCLUDE REGEX "__rosidl_generator_py$")
  foreach(target IN LISTS targets)
    get_target_property(directories "${target}" INTERFACE_INCLUDE_DIRECTORIES)
    if(NOT directories)
      continue()
    endif()
    set(existing "")
    set(missing "")
    foreach(directory IN LISTS directories)
      if(EXISTS "${directory}" OR directory MATCHES "^\\$<")
        list(APPEND existing "${directory}")
      else()
        list(APPEND missing "${directory}")
      endif()
    endforeach()
    if(NOT missing)
      continue()
    endif()
    if(NOT DEFINED python_directories)
      _find_python_include_directories(python_directories)
    endif()
    list(APPEND existing ${python_directories})
    list(REMOVE_DUPLICATES existing)
    set_target_properties(
      "${target}" PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${existing}")
  endforeach()
endfunction()

cmake_language(DEFER CALL _repair_exported_paths)
