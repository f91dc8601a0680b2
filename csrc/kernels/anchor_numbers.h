// Numbers of anchors (anchors.h), that bounds know too.
#ifndef ANCHOR_NUMBERS_H
#define ANCHOR_NUMBERS_H

#define ANCHOR_ROOTS 1023.0     // steps of the root of 1 - alpha in a key
#define ANCHOR_IMPORTANCE 63.0  // its greatest
#define ANCHOR_OCTAVES 12.0     // that importance tells apart
#define ANCHOR_STEPS 2048.0     // of a cell, to a neper
#define ANCHOR_GREATEST 24575.0 // what a fragment adds at most, 12 nepers
#define ANCHOR_FULL 40960.0     // more a cell does not tell, 20 nepers: both are less than 2^16
#define ANCHOR_NOWHERE 1e6      // the depth of a place where none is kept

#endif
