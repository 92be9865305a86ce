# cmake -DSOURCE=… -P readme.cmake: the README shows the example programs as they are, which the test `consumer` runs.
file(READ ${SOURCE}/README.md readme)
foreach(example c/turntable.c cpp/turntable.cpp python/turntable.py)
  file(READ ${SOURCE}/examples/${example} text)
  string(FIND "${readme}" "${text}" place)
  if(place EQUAL -1)
    message(SEND_ERROR "README.md does not show examples/${example} as it is")
  endif()
endforeach()
