/**
 * Lumihull's C interface: printed targets, where they are in photographs, lens calibration, resection. A part of
 * lumihull.h, whose rules hold here, too; include that.
 */
#ifndef LUMIHULL_CALIB_H
#define LUMIHULL_CALIB_H

#include <lumihull.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifdef __cplusplus
}
#endif

#endif
