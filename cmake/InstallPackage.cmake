# What `cmake --install` puts in place: the program, and the C++ API (include/agail) as the CMake package agail.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# The rooms are inside, with hidden symbols.
add_library(agail_api SHARED src/agail/api/policy.cc)
set_target_properties(agail_api PROPERTIES OUTPUT_NAME agail EXPORT_NAME agail VERSION ${PROJECT_VERSION}
                                           SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
target_include_directories(agail_api PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
                                            $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_compile_features(agail_api PUBLIC cxx_std_20)
target_link_libraries(agail_api PRIVATE agail_train)
# A policy needs neither physics nor files of demonstrations: their libraries are left out.
target_link_options(agail_api PRIVATE -Wl,--exclude-libs,ALL -Wl,--as-needed)

set_target_properties(agail PROPERTIES INSTALL_RPATH ${MuJoCo_LIBRARY_DIR})
install(TARGETS agail)
install(TARGETS agail_api EXPORT agailTargets)
install(DIRECTORY include/agail DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
set(_package ${CMAKE_INSTALL_LIBDIR}/cmake/agail)
install(EXPORT agailTargets NAMESPACE agail:: FILE agailConfig.cmake DESTINATION ${_package})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/agailConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/agailConfigVersion.cmake DESTINATION ${_package})
