# MuJoCo from the Python package `mujoco-core`: the C library and its headers, without a CMake config.
#
# AGAIL_PYTHON: the Python that has the package. Default: .venv/bin/python of the source folder if it exists, else
# python3. Defines MuJoCo::MuJoCo. The versions of the header and of the library must both be the one asked for: with
# another version, the physics would have other bits.
#
# Binaries of the build tree find the library by its absolute path (CMake's build rpath). What is installed needs an
# INSTALL_RPATH of its own: the folder MuJoCo_LIBRARY_DIR, or a path relative to $ORIGIN.
set(AGAIL_PYTHON "" CACHE FILEPATH "Python that has mujoco-core; empty: .venv/bin/python if it exists, else python3")
set(_mujoco_python "${AGAIL_PYTHON}")
if(NOT _mujoco_python)
  set(_mujoco_python python3)
  if(EXISTS "${CMAKE_SOURCE_DIR}/.venv/bin/python")
    set(_mujoco_python "${CMAKE_SOURCE_DIR}/.venv/bin/python")
  endif()
endif()
string(CONCAT _mujoco_mend "Mend it with: ${_mujoco_python} -m pip install mujoco-core==${MuJoCo_FIND_VERSION}\n"
                           "or point AGAIL_PYTHON to a Python that has it (-DAGAIL_PYTHON=/path/to/python).")

# Prints folder;library;version of the library. Does not import the package: its bindings may not be installed.
set(_mujoco_query [[
import ctypes, glob, importlib.util, os
spec = importlib.util.find_spec("mujoco")
if spec is not None:
    folder = list(spec.submodule_search_locations)[0]
    libraries = sorted(glob.glob(os.path.join(folder, "libmujoco.*")))
    if libraries:
        print(folder, libraries[0], ctypes.CDLL(libraries[0]).mj_version(), sep=";", end="")
]])
execute_process(COMMAND "${_mujoco_python}" -c "${_mujoco_query}" OUTPUT_VARIABLE _mujoco_found
                ERROR_VARIABLE _mujoco_error RESULT_VARIABLE _mujoco_status)
if(NOT _mujoco_status EQUAL 0)
  message(FATAL_ERROR "MuJoCo: asking ${_mujoco_python} for it failed (${_mujoco_status}):\n${_mujoco_error}"
                      "${_mujoco_mend}")
endif()
if(NOT _mujoco_found)
  message(FATAL_ERROR "MuJoCo: ${_mujoco_python} has no package mujoco-core.\n${_mujoco_mend}")
endif()
list(GET _mujoco_found 0 _mujoco_folder)
list(GET _mujoco_found 1 MuJoCo_LIBRARY)
list(GET _mujoco_found 2 _mujoco_library_number)

set(MuJoCo_INCLUDE_DIR "${_mujoco_folder}/include")
set(_mujoco_header_number 0)
if(EXISTS "${MuJoCo_INCLUDE_DIR}/mujoco/mujoco.h")
  file(STRINGS "${MuJoCo_INCLUDE_DIR}/mujoco/mujoco.h" _mujoco_line REGEX "#define mjVERSION_HEADER +[0-9]+")
  string(REGEX MATCH "[0-9]+" _mujoco_header_number "${_mujoco_line}")
endif()

# 4000000 -> 4.0.0. Older versions numbered otherwise (334 for 3.3.4) and come out as 0.0.334.
function(_mujoco_dotted number result)
  math(EXPR major "${number} / 1000000")
  math(EXPR minor "${number} / 1000 % 1000")
  math(EXPR patch "${number} % 1000")
  set(${result} "${major}.${minor}.${patch}" PARENT_SCOPE)
endfunction()
_mujoco_dotted("${_mujoco_library_number}" MuJoCo_VERSION)
_mujoco_dotted("${_mujoco_header_number}" _mujoco_header_version)
foreach(_mujoco_pair "library ${MuJoCo_LIBRARY};${MuJoCo_VERSION}"
                     "header ${MuJoCo_INCLUDE_DIR}/mujoco/mujoco.h;${_mujoco_header_version}")
  list(GET _mujoco_pair 0 _mujoco_what)
  list(GET _mujoco_pair 1 _mujoco_is)
  if(MuJoCo_FIND_VERSION AND NOT _mujoco_is VERSION_EQUAL MuJoCo_FIND_VERSION)
    message(FATAL_ERROR "MuJoCo: the ${_mujoco_what} has version ${_mujoco_is}, agail needs "
                        "${MuJoCo_FIND_VERSION}.\n${_mujoco_mend}")
  endif()
endforeach()

get_filename_component(MuJoCo_LIBRARY_DIR "${MuJoCo_LIBRARY}" DIRECTORY)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(MuJoCo REQUIRED_VARS MuJoCo_LIBRARY MuJoCo_INCLUDE_DIR
                                  VERSION_VAR MuJoCo_VERSION)
if(NOT TARGET MuJoCo::MuJoCo)
  add_library(MuJoCo::MuJoCo SHARED IMPORTED)
  set_target_properties(MuJoCo::MuJoCo PROPERTIES IMPORTED_LOCATION "${MuJoCo_LIBRARY}"
                                                  INTERFACE_INCLUDE_DIRECTORIES "${MuJoCo_INCLUDE_DIR}")
endif()
