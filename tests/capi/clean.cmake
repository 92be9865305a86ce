# cmake -DFOLDER=… -P clean.cmake: an empty folder.
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})
