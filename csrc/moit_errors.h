/* All errors of many images against one reference. moit.h has the errors of a pair, and says what
 * they are. */
#ifndef MOIT_ERRORS_H
#define MOIT_ERRORS_H

#include "moit.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What many images are held against: keeps, up to most_bytes, what one comparison finds out of the
 * reference for the next. The reference's pixels must stay and not change. One call at a time may
 * use it. NULL where memory is short. */
typedef struct moit_reference moit_reference;
moit_reference *moit_reference_of(const moit_image *reference, int64_t most_bytes);
void moit_free_reference(moit_reference *reference); /* NULL is fine */

typedef enum {
    MOIT_MSE,
    MOIT_RMSE,
    MOIT_MAE,
    MOIT_PSNR,
    MOIT_SSIM,
    MOIT_FLIP,
    MOIT_HDR_FLIP,
    MOIT_METRICS
} moit_metric;

/* errors[m], the same bits as the functions of moit.h give, for each wanted[m]; the image and the
 * reference may differ in precision. */
moit_status moit_errors(const moit_image *image, moit_reference *reference,
                        const bool wanted[MOIT_METRICS], double errors[MOIT_METRICS],
                        const moit_run *run);

#ifdef __cplusplus
}
#endif

#endif
