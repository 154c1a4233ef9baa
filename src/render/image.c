/* SPDX-License-Identifier: MIT
 * image.c - pictures to PNG files.
 */
#include "base/base.h"
#include "jostle/render.h"

#include <errno.h>
#include <fcntl.h>
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#define SIDE_MAX 65535
#define PATH_LENGTH 4096

typedef struct writer {
    const jsl_logger *logger;
    const char *path;
} writer;

static void on_error(png_structp png, png_const_charp text) {
    const writer *w = png_get_error_ptr(png);
    jsl_fail(w->logger, JSL_ERR_IO, "'%s': %s", w->path, text);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp text) {
    const writer *w = png_get_error_ptr(png);
    jsl_log_line(w->logger, JSL_LOG_WARNING, JSL_OK, "'%s': %s", w->path, text);
}

/* libpng leaves by longjmp, so nothing here is changed between setjmp and the end. */
static jsl_result encode(FILE *file, const uint8_t *rgb, int width, int height, writer *w) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, w, on_error, on_warning);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    if (!info) {
        png_destroy_write_struct(&png, NULL);
        return jsl_fail(w->logger, JSL_ERR_MEMORY, "'%s': no memory for libpng", w->path);
    }
    if (setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        return JSL_ERR_IO;
    }
    png_init_io(png, file);
    /* Level 4 with one filter: a third of the time of the defaults, for files a few percent larger.
     */
    png_set_compression_level(png, 4);
    png_set_filter(png, 0, PNG_FILTER_UP);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    for (int y = 0; y < height; y++)
        png_write_row(png, rgb + (size_t)3 * (size_t)width * (size_t)y);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return JSL_OK;
}

static jsl_result write_file(int descriptor, const uint8_t *rgb, int width, int height, writer *w) {
    FILE *file = fdopen(descriptor, "wb");
    if (!file) {
        close(descriptor);
        return jsl_fail(w->logger, JSL_ERR_IO, "'%s': %s", w->path, strerror(errno));
    }
    jsl_result result = encode(file, rgb, width, height, w);
    bool failed = ferror(file) != 0;
    if (fclose(file) != 0) failed = true;
    if (result == JSL_OK && failed)
        result = jsl_fail(w->logger, JSL_ERR_IO, "'%s': %s", w->path, strerror(errno));
    return result;
}

/* A new file in the same folder, under a name that nobody has; -1 with errno. */
static int open_beside(const char *path, char temporary[PATH_LENGTH]) {
    for (int k = 0; k < 100; k++) {
        int length = snprintf(temporary, PATH_LENGTH, "%s.%ld-%d.tmp", path, (long)getpid(), k);
        if (length < 0 || length >= PATH_LENGTH) {
            errno = ENAMETOOLONG;
            return -1;
        }
        int descriptor = open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0 || errno != EEXIST) return descriptor;
    }
    return -1;
}

jsl_result jsl_image_write_png(const char *path, const uint8_t *rgb, int width, int height,
                               const jsl_logger *logger) {
    if (!path || !path[0] || !rgb)
        return jsl_fail(logger, JSL_ERR_ARGUMENT, "write PNG: path or pixels are missing");
    if (width < 1 || height < 1 || width > SIDE_MAX || height > SIDE_MAX)
        return jsl_fail(logger, JSL_ERR_ARGUMENT, "'%s': a picture of %d x %d: sides are 1..%d",
                        path, width, height, SIDE_MAX);
    struct stat old;
    if (stat(path, &old) == 0 && !S_ISREG(old.st_mode)) /* renaming would replace the device */
        return jsl_fail(logger, JSL_ERR_IO, "'%s': is not a regular file", path);
    char temporary[PATH_LENGTH];
    int descriptor = open_beside(path, temporary);
    if (descriptor < 0) return jsl_fail(logger, JSL_ERR_IO, "'%s': %s", path, strerror(errno));
    writer w = {logger, path};
    jsl_result result = write_file(descriptor, rgb, width, height, &w);
    if (result == JSL_OK && rename(temporary, path) != 0)
        result = jsl_fail(logger, JSL_ERR_IO, "'%s': %s", path, strerror(errno));
    if (result != JSL_OK) unlink(temporary);
    return result;
}
