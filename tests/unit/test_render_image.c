/* SPDX-License-Identifier: MIT
 * PNG files and contact sheets.
 */
#include "helper.h"

#include "base/base.h"
#include "jostle/render.h"

#include <dirent.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#define W 37
#define H 23

static int setup(void **state) {
    char *folder = strdup("/tmp/jostle-png-XXXXXX");
    *state = mkdtemp(folder);
    return *state ? 0 : -1;
}

static int entries(const char *folder) {
    DIR *d = opendir(folder);
    int count = 0;
    assert_non_null(d);
    for (struct dirent *e; (e = readdir(d));) count += e->d_name[0] != '.';
    closedir(d);
    return count;
}

static int teardown(void **state) {
    int result = rmdir(*state);
    free(*state);
    return result;
}

static void path_in(const void *folder, const char *name, char out[256]) {
    snprintf(out, 256, "%s/%s", (const char *)folder, name);
}

static void fill(uint8_t *rgb, int width, int height, uint64_t seed) {
    for (int i = 0; i < 3 * width * height; i++) rgb[i] = (uint8_t)test_random(&seed);
}

static void read_back(const char *path, uint8_t *rgb, int width, int height) {
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_int_not_equal(png_image_begin_read_from_file(&image, path), 0);
    assert_int_equal(image.width, width);
    assert_int_equal(image.height, height);
    image.format = PNG_FORMAT_RGB;
    assert_int_not_equal(png_image_finish_read(&image, NULL, rgb, 0, NULL), 0);
}

static void a_picture_comes_back_from_its_file_unchanged(void **state) {
    char path[256];
    uint8_t rgb[3 * W * H], back[3 * W * H];
    fill(rgb, W, H, 1);
    path_in(*state, "a.png", path);
    for (int k = 0; k < 2; k++) { /* the second time over the first */
        assert_ok(jsl_image_write_png(path, rgb, W, H, NULL));
        read_back(path, back, W, H);
        assert_memory_equal(rgb, back, sizeof rgb);
        fill(rgb, W, H, 2);
    }
    assert_int_equal(entries(*state), 1);
    struct stat info;
    assert_int_equal(stat(path, &info), 0);
    mode_t mask = umask(0);
    umask(mask);
    assert_int_equal(info.st_mode & 0777, 0666 & ~mask);
    unlink(path);
}

static void a_path_that_cannot_be_written_leaves_nothing(void **state) {
    char path[256];
    uint8_t rgb[3 * W * H];
    test_log log = {0};
    jsl_logger logger = test_logger(&log);
    fill(rgb, W, H, 3);
    path_in(*state, "missing/a.png", path);
    assert_result(jsl_image_write_png(path, rgb, W, H, &logger), JSL_ERR_IO);
    assert_int_equal(log.lines, 1);
    assert_non_null(strstr(log.text, "missing/a.png"));
    /* The name is taken by a folder: the file is complete before that is known. */
    path_in(*state, "folder", path);
    assert_int_equal(mkdir(path, 0777), 0);
    assert_result(jsl_image_write_png(path, rgb, W, H, &logger), JSL_ERR_IO);
    assert_int_equal(entries(*state), 1);
    assert_int_equal(log.lines, 2);
    rmdir(path);
    char *longer = calloc(1, 6000);
    assert_non_null(longer);
    memset(longer, 'x', 5999);
    assert_result(jsl_image_write_png(longer, rgb, W, H, &logger), JSL_ERR_IO);
    free(longer);
}

static void bad_arguments_are_refused(void **state) {
    (void)state;
    uint8_t rgb[3] = {0};
    assert_result(jsl_image_write_png(NULL, rgb, 1, 1, NULL), JSL_ERR_ARGUMENT);
    assert_result(jsl_image_write_png("", rgb, 1, 1, NULL), JSL_ERR_ARGUMENT);
    assert_result(jsl_image_write_png("x.png", NULL, 1, 1, NULL), JSL_ERR_ARGUMENT);
    assert_result(jsl_image_write_png("x.png", rgb, 0, 1, NULL), JSL_ERR_ARGUMENT);
    assert_result(jsl_image_write_png("x.png", rgb, 1, 70000, NULL), JSL_ERR_ARGUMENT);
}

static void a_sheet_holds_the_means_of_its_pictures(void **state) {
    (void)state;
    jsl_image_sheet sheet = {.count = 3, .columns = 2, .width = 8, .height = 6, .scale_down = 2};
    int width = 0, height = 0;
    assert_ok(jsl_image_sheet_size(&sheet, &width, &height));
    assert_int_equal(width, 2 * 4 + 3 * JSL_SHEET_GAP);
    assert_int_equal(height, 2 * 3 + 3 * JSL_SHEET_GAP);
    uint8_t *out = calloc((size_t)(3 * width * height), 1), rgb[3 * 8 * 6];
    assert_non_null(out);
    fill(rgb, 8, 6, 4);
    for (int index = 0; index < 3; index++) assert_ok(jsl_image_sheet_put(&sheet, index, rgb, out));
    for (int index = 0; index < 3; index++)
        for (int y = 0; y < 3; y++)
            for (int x = 0; x < 4; x++)
                for (int c = 0; c < 3; c++) {
                    int sum = 0;
                    for (int k = 0; k < 4; k++)
                        sum += rgb[3 * ((2 * y + k / 2) * 8 + 2 * x + k % 2) + c];
                    int u = JSL_SHEET_GAP + index % 2 * (4 + JSL_SHEET_GAP) + x;
                    int v = JSL_SHEET_GAP + index / 2 * (3 + JSL_SHEET_GAP) + y;
                    assert_int_equal(out[3 * (v * width + u) + c], (sum + 2) / 4);
                }
    int lit = 0;
    for (int i = 0; i < width * height; i++)
        lit += (out[3 * i] | out[3 * i + 1] | out[3 * i + 2]) != 0;
    assert_true(lit <= 3 * 4 * 3); /* gaps and the empty cell are as they were */
    free(out);
}

static void sheets_out_of_range_are_refused(void **state) {
    (void)state;
    static const jsl_image_sheet bad[] = {{0, 1, 8, 8, 1},  {1, 0, 8, 8, 1},    {1, 1, 0, 8, 1},
                                          {1, 1, 8, -8, 1}, {1, 1, 8, 8, 65},   {1, 1, 3, 8, 4},
                                          {1, 1, 8, 8, -1}, {20000, 1, 8, 8, 1}};
    int width = 7, height = 7;
    uint8_t byte[3] = {0};
    for (int k = 0; k < JSL_COUNT(bad); k++) {
        assert_result(jsl_image_sheet_size(&bad[k], &width, &height), JSL_ERR_ARGUMENT);
        assert_result(jsl_image_sheet_put(&bad[k], 0, byte, byte), JSL_ERR_ARGUMENT);
    }
    assert_int_equal(width, 7);
    jsl_image_sheet good = {1, 1, 8, 8, 1};
    assert_result(jsl_image_sheet_put(&good, 1, byte, byte), JSL_ERR_ARGUMENT);
    assert_result(jsl_image_sheet_put(&good, -1, byte, byte), JSL_ERR_ARGUMENT);
    assert_result(jsl_image_sheet_put(&good, 0, NULL, byte), JSL_ERR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_comes_back_from_its_file_unchanged),
        cmocka_unit_test(a_path_that_cannot_be_written_leaves_nothing),
        cmocka_unit_test(bad_arguments_are_refused),
        cmocka_unit_test(a_sheet_holds_the_means_of_its_pictures),
        cmocka_unit_test(sheets_out_of_range_are_refused),
    };
    return cmocka_run_group_tests_name("render image", tests, setup, teardown);
}
