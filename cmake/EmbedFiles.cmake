# agail_embed_files(<target> <function> <header> <file>...)
#
# Compiles text files into <target>: generates the definition of
#   std::span<const EmbeddedFile> agail::<function>();
# which <header> declares. The files come in the given order and are read at build time.
set(AGAIL_EMBED_SCRIPT ${CMAKE_CURRENT_LIST_DIR}/EmbedFilesScript.cmake)

function(agail_embed_files target function header)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/embedded/${function}.cc)
  add_custom_command(
    OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DFUNCTION=${function} -DHEADER=${header}
            "-DFILES=${ARGN}" -P ${AGAIL_EMBED_SCRIPT}
    DEPENDS ${ARGN} ${AGAIL_EMBED_SCRIPT}
    COMMENT "Embedding files for ${function}()"
    VERBATIM)
  target_sources(${target} PRIVATE ${output})
endfunction()
