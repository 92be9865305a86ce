# cmake -DRIG=… -DFOLDER=… -P rig_photos.cmake: a small session of the virtual rig for the tests of the C interface and of
# Python: 24 photographs of 240 x 160 pixels, 2 of the empty enclosure, projection matrices, the truth.
file(REMOVE_RECURSE ${FOLDER})
execute_process(COMMAND ${RIG} --plain -o ${FOLDER} --object vase --photos 24 --empty 2 --width 240 --format png --seed 5
  RESULT_VARIABLE status ERROR_VARIABLE progress)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${progress}")
endif()
