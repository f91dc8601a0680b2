/* What slices of optical depth share: places of depth, and what blocks of pixels keep. */
#ifndef MOIT_SLICES_H
#define MOIT_SLICES_H

#include "core/squares.h"
#include "core/techniques/upsampling.h"
#include "core/tile.h"

enum { MOIT_MOST_SLICES = 256, MOIT_MOST_SLICE_CELLS = 8192, MOIT_VOXEL_GUARD = 3 };

struct moit_slices;
struct moit_slice_rows;

/* What a technique of slices makes of the whole image. */
typedef struct moit_slices {
    /* Of a tile's fragments slots and what the slices at their front and back get of them. */
    void (*place)(const moit_job *job, const struct moit_slices *slices, moit_tile *tile,
                  const struct moit_slice_rows *rows);
    bool saturates;       /* a slice has a code's most at most */
    bool guarded;         /* cells near those with anything have slices, too: moit_voxel_table */
    bool of_middle;       /* blocks have what the pixel at their middle has, not the mean */
    bool always_blocks;   /* pixels, too, are blocks */
    int length;           /* cells of a joined one, where all have as many */
    moit_squares regions; /* that have a table each; side 0: the image is one */
    moit_squares blocks;  /* that have slices of their own; side 1: pixels have */
    int cells, slots;
    double quantum;          /* optical depth of a step */
    moit_slice_entry *table; /* (regions, cells); NULL: each pixel's is made where it is read */
    uint32_t *sums;   /* (blocks, slots + 3): before each slice, in steps; NULL: pixels have them */
    uint8_t *through; /* (blocks, slots): light behind each slice, in 255 steps; NULL: not asked */
    double *powers;   /* (blocks, 4): slices times powers of where they stand; NULL: not asked */
    moit_guides guides; /* where shares of blocks go by opaque surfaces */
} moit_slices;

/* A code's largest, 255 or 65535, and the optical depth that it stands for. */
double moit_slice_most(const moit_technique *technique);
double moit_slice_depth_of_most(const moit_technique *technique);

/* A side in pixels of what has a table; 0: the image is one. */
int64_t moit_slice_region_side(const moit_technique *technique);

/* Which cells have anything, as bits (cells / 64 words), become their entries: cells are joined so
 * far as there are more slices than `slots` otherwise. */
void moit_slice_table(int cells, int slots, const uint64_t *words, moit_slice_entry *table);

/* The same as published: cells are joined by twos, slices stand at the front of cells with anything
 * or such within the guard, and there are fewer than `slots`. Gives how many cells are joined. */
int moit_voxel_table(int cells, int slots, const uint64_t *words, moit_slice_entry *table);

/* Places, of a tile's fragments or of depths to ask at, and what is read there. */
typedef struct moit_slice_places {
    char *cell, *inside;                /* as tables have cells */
    char *from, *share, *joined;        /* how far in a joined cell */
    char *before, *at, *behind, *twice; /* sums around them */
    char *weight, *depth, *low, *full;  /* what is read of blocks, and pixels' own totals */
    double *at_least, *at_most;         /* shares that a pixel's moments prove */
    int32_t *slot;
} moit_slice_places;

/* A tile's own room. */
typedef struct moit_slice_rows {
    moit_slice_places of_fragments, of_depths;
    char *code, *near, *far; /* steps, and what the slices in front and behind get */
    uint32_t *row, *column;
    int corners;     /* blocks around a pixel that are read: 4, of cubic ones 16 */
    int64_t *corner; /* (pixels, corners) these blocks */
    double *share;   /* (pixels, corners) of these */
    const moit_slice_entry **table_of; /* (pixels) */
    const uint32_t **sums_of;          /* (pixels) */
    uint32_t *sums;                    /* (slots + 3) of a pixel */
    moit_slice_entry *table;           /* (cells) of a pixel */
    uint64_t *words;
} moit_slice_rows;

size_t moit_slices_scratch(const moit_job *job, int fragments, int pixels);
moit_slice_rows moit_slice_rows_of(const moit_job *job, const moit_tile *tile);

/* Absorbance, z, cells and codes of a tile's fragments. */
void moit_slices_place(const moit_job *job, moit_tile *tile, const moit_slice_rows *rows);

/* Slots of the tile's fragments, and of the job's depths after moit_slices_place_all, and how far
 * in joined cells they are. */
void moit_slices_join(const moit_job *job, const moit_slices *slices, const moit_tile *tile,
                      const moit_slice_rows *rows, bool depths);

/* Places of fragments and, where the job has some, of depths. */
void moit_slices_place_all(const moit_job *job, moit_tile *tile, const moit_slice_rows *rows);

/* Makes pixel p's own table in rows->table; where there are tables of regions nobody asks. */
void moit_slices_own_table(const moit_job *job, const moit_slices *slices, const moit_tile *tile,
                           const moit_slice_rows *rows, int p);

/* Sums before the slices around the places asked about in pixels first to first + n, joined then;
 * of the last pixel those before each slice, in rows->sums, or unless `all` before those that
 * fragments have. */
void moit_slices_sum(const moit_job *job, const moit_slices *slices, const moit_tile *tile,
                     const moit_slice_rows *rows, int first, int n, bool all);

/* The same fragments as a job of four power moments. */
moit_job moit_slices_job_of_moments(const moit_job *job, moit_technique *moments);

/* What four power moments prove, as moit_technique_row.bounds. */
void moit_slices_moment_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper);

/* Makes slices->powers of what blocks keep. */
moit_status moit_slice_moments_make(const moit_technique *technique, moit_slices *slices);

/* After moit_slices_moment_bounds and moit_slice_blocks_read: light, or what is absorbed, in front
 * of places as the slices stand within the pixels' moments. */
void moit_slices_stand(const moit_job *job, moit_tile *tile, const moit_slice_rows *rows, void *T);

/* What is in front of places as blocks around their pixels have it: `depth` in steps, `low` and
 * `full` the totals of these and of the pixels themselves, places->depth .. of each place. */
void moit_slice_blocks_read(const moit_job *job, const moit_tile *tile, const int32_t *offsets,
                            const moit_slice_places *places, const moit_slice_rows *rows);

/* The region that a block is in, and how many steps a block has in all. */
int64_t moit_slice_region_of(const moit_slices *slices, int64_t block);
double moit_slice_steps_of(const moit_slices *slices, int64_t block);

/* The blocks around pixels, into rows->corner and share; and of the k-th of them what its table
 * says of places, and its share. */
void moit_slice_corners(const moit_job *job, const moit_tile *tile, const moit_slice_rows *rows);
void moit_slice_corner(const moit_job *job, const moit_tile *tile, const int32_t *offsets,
                       const moit_slice_places *places, const moit_slice_rows *rows, int k);

/* What is asked about: the tile's fragments, or depths where the job has some. */
const int32_t *moit_slice_offsets(const moit_job *job, const moit_tile *tile);
const moit_slice_places *moit_slice_places_of(const moit_job *job, const moit_slice_rows *rows);

/* As moit_slices.place: by moit_slices_place and moit_slices_join. */
void moit_slices_place_in(const moit_job *job, const moit_slices *slices, moit_tile *tile,
                          const moit_slice_rows *rows);

/* Makes job->prepared of the whole image, as `how` says. */
moit_status moit_slices_make(moit_job *job, const moit_slices *how, bool tables_alone);

/* How avboit makes its own. */
moit_slices moit_voxels_as_published(const moit_technique *technique);

moit_status moit_slices_prepare(moit_job *job);
void moit_slices_release(moit_job *job);

#endif
