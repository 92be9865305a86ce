# cmake -DABIDW=… -DABIDIFF=… -DLIBRARY=… -DCAPI=… -DWORK=… -P abi.cmake: the library is compatible with what was promised.
# New functions, and members at the end of structures, are compatible; `ninja abi-baseline` then writes the baseline anew.
set(now ${WORK}/lumihull_now.abi)
include(${CAPI}/abi/describe.cmake)
describe_abi(${ABIDW} ${LIBRARY} ${CAPI}/include ${now})
file(READ ${CAPI}/abi/lumihull.abi baseline)
if(NOT baseline MATCHES "lh_capture_run" OR baseline MATCHES "path='/|comp-dir-path|filepath=")
  message(FATAL_ERROR "the baseline is empty or holds a path of the machine that it was made on")
endif()
execute_process(COMMAND ${ABIDIFF} --no-added-syms --suppressions ${CAPI}/abi/lumihull.suppr ${CAPI}/abi/lumihull.abi ${now}
  RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "the C interface has changed incompatibly (abidiff's status ${status})")
endif()
