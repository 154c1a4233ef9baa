/* SPDX-License-Identifier: MIT
 * Colours of entities.
 */
#include "world/world_internal.h"

JSL_COMPONENT_FIELDS(look, JSL_LOOK_FIELDS);

jsl_result jsl_look_set_n(jsl_world *w, const jsl_entity *entity, int64_t count, uint32_t rgba) {
    if (!w || (!entity && count > 0) || count < 0)
        return jsl_world_bad_argument(w, "jsl_look_set_n", "null argument");
    jsl_component look;
    JSL_TRY(jsl_component_register(
        w->ecs, &(jsl_component_desc){"look", look_fields, JSL_COUNT(look_fields), false}, &look));
    JSL_TRY(jsl_entity_add_n(w->ecs, entity, count, &look, 1));
    for (int64_t i = 0; i < count; i++) {
        uint32_t *at = jsl_entity_field(w->ecs, entity[i], look, 0);
        if (at) *at = rgba;
    }
    return JSL_OK;
}
